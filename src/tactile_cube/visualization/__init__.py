"""What an episode and a training run looked like: Rerun recordings, films, curves and reports."""
