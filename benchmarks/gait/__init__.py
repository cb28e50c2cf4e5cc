"""Search for the scripted gait that `exploration=demonstrations` plays."""
