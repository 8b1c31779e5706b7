"""Plot of a Monte Carlo batch: where most flights are, over time."""

from collections.abc import Sequence

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sbs_sim.analysis.batch import Batch, percentiles
from sbs_sim.analysis.monte_carlo import SHARES, quantities
from sbs_sim.output.plot_style import COLOURS

SHOWN = ("height [m]", "u [m/s]", "v [m/s]", "roll [deg]", "pitch [deg]", "power [W]")
SINGLE = 12  # flights that are drawn one by one


def batch_figure(batch: Batch, shown: Sequence[str] = SHOWN) -> Figure:
    """Median, the bands that hold half and nine tenths of the flights, and the first flights one by one."""
    figure = Figure(figsize=(12.0, 7.0), layout="constrained")
    FigureCanvasAgg(figure)
    flown = quantities(batch)
    panels = figure.subplots(-(-len(shown) // 3), 3, sharex=True)
    for axes, name in zip(panels.flat, shown, strict=False):
        low, lower, median, upper, high = percentiles(flown[name], SHARES)
        axes.fill_between(batch.time, low, high, color=COLOURS[0], alpha=0.18, linewidth=0, label="5 to 95 %")
        axes.fill_between(batch.time, lower, upper, color=COLOURS[0], alpha=0.35, linewidth=0, label="25 to 75 %")
        for i, values in enumerate(flown[name][:SINGLE]):
            label = "single flights" if i == 0 else None
            axes.plot(batch.time, values, color="0.35", linewidth=0.5, alpha=0.7, label=label)
        axes.plot(batch.time, median, color=COLOURS[1], linewidth=1.8, label="median")
        axes.set_ylabel(name)
        axes.grid(True, color="0.85", linewidth=0.6)
        axes.margins(x=0.0)
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    panels.flat[0].legend(fontsize=8, framealpha=0.85)
    ended = len(batch.failed)
    title = f"{batch.cases[0].aircraft.name}: {len(batch.cases)} flights"
    # the name comes from a file: a $ begins no formula
    figure.suptitle(f"{title}, {ended} ended early" if ended else title, parse_math=False)
    return figure
