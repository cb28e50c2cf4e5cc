"""What a law of the drivetrain can see of its finger: rows of `x` (ROWS, n), one column a joint.

A step fills the rows in this order; a law that runs before a row is filled sees the previous step's value.
"""

POSITION = 0  # q: link side of the drive [rad]
VELOCITY = 1  # speed of the joint [rad/s]
ACCELERATION = 2  # acceleration in the previous step [rad/s^2]
CONTACT = 3  # torque from outside on the joint: contacts, known loads [N m]
LOAD = 4  # gravity, Coriolis and coupling torque less CONTACT: what the drive has to hold [N m]
TIME = 5  # time since the start of the robot's initialisation or of the episode [s]
COMMAND = 6  # q_d: desired position that reaches the controller [rad]
MEASURED_VELOCITY = 7  # speed that the controller damps with [rad/s]
CONTROLLER_TORQUE = 8
"""What the impedance law has in the torque that the controller asks for, which is limited as a whole [N m]."""
TORQUE = 9  # torque that the motor gives to the drive [N m]
DEFLECTION = 10  # q_m - q: what the drive's elasticity (and play) adds [rad]
MOTOR_POSITION = 11  # q_m: position that the sensor on the motor side reports [rad]
JOINT_TORQUE = 12  # further torque on the joint that depends smoothly on its motion [N m]
DIRECTION = 13  # sign of the speed; at rest, the sign of the torque that pushes the joint
FRICTION = 14  # largest dry-friction torque against DIRECTION, zero or more [N m]
DAMPING = 15
"""Slope of the torque on the joint against its present speed: what acts at the middle of a step [N m s/rad]."""
ANGLE = 16  # angle of the mechanism [rad]: POSITION and what the joint's initialisation read too little
LEAD = 17  # q_d - q_m - K_D / K_P dq [rad] of a motor that carries no torque: zero where the controller lets it stand
GAP = 18
"""Where the motor stands in its transmission: 0 there is no gap, 1 on a flank, 2 free, so that it does not show q."""
WEIGHT = 19  # torque that holds the links against gravity [N m]: a part of LOAD. Zero unless some effect `weighs`.
LOOP_GAIN = 20
"""Slope of TORQUE against LEAD within a step: K_P / (1 + K_P compliance), or what a lag lets pass [N m/rad]."""
LOOSE_TORQUE = 21  # torque that the motor would carry did no law of the position sensor lead it or hold it back [N m]
SENSOR_VELOCITY = 22  # speed of what the position sensor reads: of the joint, or of a rotor behind a spring [rad/s]
MOTOR_SHARE = 23  # part of FRICTION that acts on a rotor behind a spring and not on the link
INERTIA = 24  # inertia of the joint, rotor included, while the others stand [kg m^2]
COMMAND_AFTER = 25
"""What COMMAND will be at the end of the step [rad]; a command that jumps at its beginning is the mean there."""
ROWS = 26
