r"""Sets of the G800 language as posts of CAM systems make controls print them, and what they mean.

The words and numbers of the first two points stand in a public survey of inspection result formats (the posts of Fusion for Haas and
Fanuc, samples in forums); the lines between were written by hand from its description. Simulator and driver are held against them alike.
"""

OPENING = "START\r\nRESULTSFILE SLEEVE-RESULTS\r\nTOOLPATHID 12\r\nTOOLPATH SLEEVE\r\n"
PLANES = "G331 N1 A-90. B0. C0. X0. Y1.8 Z0.\r\nG330 N1 A0. B0. C0. X0 Y0 Z0 I0 R0\r\n"
POINTS = (
    "G800 N1 X-0.4394 Y0.5291 Z-0.0753 I0.63893 J-0.76927 K0. O0. U0.005 L0.005\r\n"
    "G801 N1 X-.4187 Y.5040 Z-.0753 R.0345\r\n"
    "G802 N1 DEVIATION 0.0012\r\n"
    "G800 N2 X-0.4 Y0.5 Z0. I1. J0. K0. O0. U0.005 L0.005\r\n"
    "G801 N2 X-.3655 Y.5000 Z.0000 R.0345\r\n"
)
GOLDEN = f"{OPENING}{PLANES}{POINTS}END\r\n".encode("ascii")
INCHES = ((-0.4187, 0.5040, -0.0753), (-0.3655, 0.5, 0.0))
RADIUS_MM = 0.0345 * 25.4
DPRNT = b"\x12X   1.5436 Y-   .2500 Z  -0.054\rX  12.    Y    .0000 Z   0.   \rM30\r\x14"
DPRNT_PATTERN = "X(?P<x>[-+ .0-9]+)Y(?P<y>[-+ .0-9]+)Z(?P<z>[-+ .0-9]+)"
DPRNT_MM = ((1.5436, -0.25, -0.054), (12.0, 0.0, 0.0))
PRINT_OUT = (
    "------------------------------------------\r\nCOMPONENT NO 1  FEATURE NO 2\r\n"
    "POSN X79.0569 ACTUAL 79.0012 TOL TP 0.2000 DEV -0.0557\r\nSIZE D71.0000 ACTUAL 71.9072 TOL 0.1000 DEV 0.9072\r\n"
    "+++++OUT OF TOL+++++ ERROR TP 0.0135 RADIAL\r\n"
).encode("ascii")
