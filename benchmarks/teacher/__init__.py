"""The teacher of the recipe: a search for the scripted gait that `exploration=demonstrations` plays."""
