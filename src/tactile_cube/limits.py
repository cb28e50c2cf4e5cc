"""Size limits of files: larger ones are damaged, or would take too much memory or time."""

TEXT = 2_000_000  # bytes of YAML or URDF: a recording of 10 000 trials has 1 MB, a humanoid's URDF 0.2 MB
VALUES = 200_000
"""Keys and values in a YAML file, those that aliases repeat counted each time: 20 000 trials have as many."""
DEPTH = 50  # lists and mappings of a YAML file within each other; a recording has five
TABLE = 1_000_000_000  # bytes of a table, an archive or a bag: `NUMBERS` as text
NUMBERS = 30_000_000
"""Numbers in a table, an archive and all trials of a recording: 27 minutes of 12 joints at 500 Hz, read in 1 GB."""
COLUMNS = 4096  # columns of a table, arrays of an archive: 100 joints with 40 signals each
LINE = 1_000_000  # bytes of a line of a CSV file: `COLUMNS` numbers have a tenth of that
MESSAGES = 2_000_000  # messages of a bag on the two topics that are read: 17 minutes at 1 kHz, of 1 kB each in memory
CHUNK = 100_000_000  # bytes of a bag's chunk when it is unpacked: ROS 2 writes chunks of 1 to 4 MB
MESH = 100_000_000  # bytes of a mesh: two million triangles
JOINTS = 1000  # joints of a URDF; all pairs of them are looked at
NUMBER = 1e9  # largest size of a finite number in SI units: 1e9 N m/rad is rigid, 1e9 N m is more than any drive has
MASS = 1e5  # [kg] of a link or an object: an excavator's boom has 5e3 kg
RATE = 1e6  # [Hz] of samples and of controllers; current loops run at 4e4
