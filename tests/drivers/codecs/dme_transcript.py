"""A session between a client and a server of I++ DME, as a foreign parser of commands and responses accepted it.

Written by hand from the specification's rules, version 1.4.3, and held against driver and simulator alike.
"""

GOLDEN: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("00001 StartSession()", ("00001 &", "00001 %")),
    ("00002 Home()", ("00002 &", "00002 %")),
    ('00003 ChangeTool("Probe1")', ("00003 &", "00003 %")),
    ("00004 OnScanReport(X(), Y(), Z())", ("00004 &", "00004 %")),
    (
        "00005 ScanOnLine(0,0,0,20,0,0,0,0,1,0.5)",
        ("00005 &", "00005 # 0.0,0.0,1.5,0.5001,0.0,1.5002", "00005 # 1.0002,0.0,1.4999", "00005 %"),
    ),
    ("00006 PtMeas(X(10), Y(0), Z(0), IJK(0,0,1))", ("00006 &", "00006 # X(10.0002), Y(0), Z(1.4998)", "00006 %")),
    (
        "00007 GoTo(X(1000000))",
        ("00007 &", '00007 ! Error(3, 2500, "GoTo", "Machine limit encountered [Move Out Of Limits]")', "00007 %"),
    ),
    ("00008 Get(X())", ("00008 &", '00008 ! Error(2, 0514, "Get", "Use ClearAllErrors to continue")', "00008 %")),
    ("00009 ClearAllErrors()", ("00009 &", "00009 %")),
)
SCANNED_MM = ((0.0, 0.0, 1.5), (0.5001, 0.0, 1.5002), (1.0002, 0.0, 1.4999))
TOUCHED_MM = (10.0002, 0.0, 1.4998)
ABORT = (
    ("00010 ScanOnCircle(0,0,0,10,0,0,0,0,1,360,0,1)", ("00010 &",)),
    (
        "E0011 AbortE()",
        (
            "E0011 &",
            '00010 ! Error(2, 0006, "ScanOnCircle", "Transaction aborted (Use ClearAllErrors to Continue)")',
            "00010 %",
            "E0011 %",
        ),
    ),
)
EMERGENCY = 'E0000 ! Error(3, 0500, "HealthCheck", "Emergency stop")'
