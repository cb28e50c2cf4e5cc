"""Where recordings come from: a simulated rig, tables of other programs, ROS 2 bags, published data sets."""
