"""How curves are distinguished in plots.

The colours are those of Okabe and Ito, which people see alike who do not see all colours.
"""

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
DASHES = ("-", "--", "-.", ":")
