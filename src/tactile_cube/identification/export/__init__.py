"""A model in the words of other programs: MJCF, URDF, BAM."""
