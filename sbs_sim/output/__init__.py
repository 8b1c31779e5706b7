"""Results as files, JSON, HTML and plots."""
