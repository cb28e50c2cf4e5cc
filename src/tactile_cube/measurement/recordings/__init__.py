"""A recording on disk: what it may say, read, checked and written."""
