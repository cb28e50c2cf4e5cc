"""What measures this project; nothing here is needed to use it."""
