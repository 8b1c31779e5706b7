"""Many calls at once: threads, clusters, and how they are interrupted."""
