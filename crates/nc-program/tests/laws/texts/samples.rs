//! Short programs of every dialect, with the features of real ones.

use facemill_nc_program::read::{
    ReadError, read_fanuc, read_haas, read_heidenhain, read_linuxcnc, read_mazak, read_siemens,
};
use facemill_nc_program::*;

/// A program and its reader.
pub(crate) struct Sample {
    pub(crate) name: &'static str,
    pub(crate) text: &'static str,
    pub(crate) read: fn(&[u8]) -> Result<ReadProgram, ReadError>,
}

/// One of each dialect.
pub(crate) fn all() -> Vec<Sample> {
    vec![
        Sample { name: "fanuc", text: FANUC, read: |text| read_fanuc(text) },
        Sample { name: "haas", text: HAAS, read: |text| read_haas(text) },
        Sample { name: "mazak", text: MAZAK, read: |text| read_mazak(text) },
        Sample { name: "linuxcnc", text: LINUXCNC, read: |text| read_linuxcnc(text) },
        Sample { name: "siemens", text: SIEMENS, read: |text| read_siemens(text) },
        Sample { name: "heidenhain", text: HEIDENHAIN, read: |text| read_heidenhain(text) },
    ]
}

pub(crate) const FANUC: &str = "%
O1001 (PART F100 NOT A FEED)
N10 G21 G90 G94 G17 G40 G49 G80
N20 T5 M6
N30 G54 G0 X0 Y-.5 Z 1 0 0 . B0. C0.
N40 S600 M3
#100=250. (FEED)
#101=[#100*2]
N50 G43 Z50. H5
N60 G1 X10. Y5. F#100
N70 G1 X[#100-230.] Z-1. F 1 2 0 . ( F300 )
N80 X25. F#101 ; F5
N90 G2 X30. Y10. I5. J0.
N100 G93 G1 X31. B5. F.5
N110 X32. B6. F4
N120 G94 G1 X40.F100
N130 G81 X50. Y0. Z-5. R2. F80.
N140 X60.
N150 G80
N160 G65 P9010 A1. F50.
N170 G0 X0. Y0. Z100.
N180 G1 Z90. F200.
N190 M98 P1000 L2
N200 G91 G28 Z0.
N210 M30
%
";

pub(crate) const HAAS: &str = "%
O02000 (BLADE)
G20 G90 G17 G40 G49 G80
G21
T2 M06
G154 P7 G00 X10. Y20. B0. C0. S1200 M03
G187 P3 E0.01
G234 H02 Z50.
G01 Z5. F500.
X20. B10. C5.
X30. B11. C6. F400
G49
G13 D1 I2. K10. Q1. F300.
G00 Z60.
G154 P8
G110 X1. Y1. Z1. B0.
G1 X2. F100.
M97 P200 L3
G103 P1
G84 X5. Y6. Z-3. R1. F90.
G80
G53 G00 Z0.
M88
M30
%
";

pub(crate) const MAZAK: &str = "O1234(FRAME)
G21G90G94G17
T001T002M06
G61.1
G54.1P12
G00X0.Y0.A0.C0.S900M03
G43.4H1Z100.
G05P2
G01X10.Y1.Z-2.A-10.C30.F1500.
X11.Y2.A-11.C31.
X12.F1400.
G05P0
G49
T12.1M06
G91G28Z0.
M30
";

pub(crate) const LINUXCNC: &str = "; five axes
        #<depth>  =   -5 ; mm
  #<feed> = [100 * 4]
g21 g90 g49 g54 g40
t2 m6 g43
m428
g0 x0y0z#<depth>b0c0 w0
f#<feed>
g1 x[ #<depth> - 1.5 ] y-#<depth>
g1 x 1 2 z-[sin[30]*4]
(debug, #<depth>)
g93 g1 x13 a 5 f 2.5
x14 a6 f3
g94
f250
g64 p0.01 q0.02
g2 x20 y5 i3 j0 p2
g10 l20 p0 x-[#<_hal[xyzab_kins.x-rot-point]>+1] y0
g1 x1 y1 z1
o100 while [#<i> lt 8]
    #<i> = [#<i>+1]
    g1 x#<i> f 300
o100 endwhile
o<drill> call [1] [#<depth>]
g53 g0 x0y0z0
m66e0l0 ; sync
g4 p0.5
m2
";

pub(crate) const SIEMENS: &str = r#"%_N_BLADE_MPF
;$PATH=/_N_WKS_DIR/_N_BLADE_WPD
N10 ;start F100
N20 DEF REAL _tol=.02, _X_HOME, _Z_HOME
N30 DEF REAL _F_CUT
N40 G40 G17 G710 G94 G90 G60 G601 FNORM
_X_HOME=-365. _Z_HOME=610. R1=5 R2 = R1 * 2 + 1
_F_CUT=1500
N50 CYCLE800()
N60 TRAFOOF
N70 SUPA G0 Z=_Z_HOME D0
N80 SUPA G0 X=_X_HOME Y=200. B=0.0 C=R1-5 D1
N90 T="FACE_D80; R6"
N100 M6
MSG("FINISH; F5000")
N110 CYCLE832(_tol,1,1)
N120 COMPCAD SOFT FFWON
N130 G54
N140 G0 X-10. Y-22.7 Z16. B0 C0 S10345 D1 M3 M8
N150 G1 Z0.0 F=_F_CUT
N160 X-14.5F2000 ; next
N170 G3 X-15.8 Y-24. I0.0 J-1.3
N180 G2 X0 Y20. I=AC(0) J=IC(2) TURN=2 CR=5.5
N190 G1 X=IC(5) Y=AC(R2) C=DC(350)
N200 Z = R9
TRAORI
ORIWKS ORIVECT
G1 X1 Y2 Z3 A3=0 B3=0.1 C3=.995 F3000
X2 A3=0 B3=0.2 C3=.98
X3 Y3 Z3 A0 C10
TRAFOOF
N210 TRANS X5 Y0 Z0
N220 AROT Z90
N230 G0 X0 Y0 Z50
MCALL CYCLE81(10,0,2,-5)
N240 X5 Y5 F300
X10
MCALL
AROUND: G0 X0 Y0 Z100
N250 G4 F2.5
G1 Z90
IF R1>5 GOTOB AROUND
REPEAT_ME
L100 P2
FGROUP(X,Y,Z)
G93 G1 X5 Y5 Z5 F=12.5
G75 FP=1 Z1=0
N260 G500 G1 X7 G94 F100
/N270 M30
"#;

pub(crate) const HEIDENHAIN: &str = r#"0 BEGIN PGM BLADE MM
1 BLK FORM 0.1 Z X+0 Y+0 Z-20
2 BLK FORM 0.2 X+100 Y+100 Z+0
3 ;F100 is no feed
4 * - FINISHING
5 TOOL CALL 5 Z S3000 F500 DL+0 DR+0
6 TOOL DEF 6
7 FN 0: Q1 = +5
8 FN 1: Q2 = +Q1 + +2.5
9 Q3 = Q2 * SIN (30) + 1 ; formula
10 CYCL DEF 247 DATUM SETTING ~
     Q339=+1 ;DATUM NUMBER
11 CYCL DEF 32.0 TOLERANCE
12 CYCL DEF 32.1 T0.01
13 CYCL DEF 32.2 HSC-MODE:0 TA0.5
14 PLANE RESET STAY
15 L Z+100 R0 FMAX M91
16 L X+0 Y+0 A+0 C+0 R0 FMAX M3
17 L Z+50 FMAX M128 F2000
18 L Z+Q1 F1000
19 L X+10,5 Y-5 A-10 C+30 F1500 M8
20 L X+11 A-11
21 L IX+1.5 C+Q3 F AUTO
22 LN X+10 Y+2 Z+3 NX+0 NY+0.1 NZ+0.995 TX+0 TY+0.2 TZ+0.98 F800 M128
23 LN X+11 Y+2 Z+3 TX+0 TY+0.2 TZ+0.98
24 L X+0 Y+0 Z+10 A+0 C+0
25 L Z+100 FMAX M129
26 CC X+50 Y+50
27 L X+70 Y+50 Z+5 F300
28 C X+50 Y+70 DR+
29 CR X+60 Y+60 R+20 DR- R0 F250
30 LP PR+20 PA+0
31 CP IPA+90 DR+ F200
32 FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS
33 L X+1 Y+1 Z+1 C+10 FQ2
34 FUNCTION RESET TCPM
35 CYCL DEF 200 DRILLING ~
     Q200=+2 ;SET-UP CLEARANCE ~
     Q201=-20 ;DEPTH ~
     Q206=+150 ;FEED RATE FOR PLNGNG
36 L X+5 Y+5 Z+20 R0 FMAX M99
37 CYCL CALL POS X+10 Y+10 Z+0 FMAX
38 LBL 1
39 L IX+5 F400
40 LBL 0
41 CALL LBL 1 REP 3
42 FN 9: IF +Q1 EQU +Q2 GOTO LBL 1
43 PLANE SPATIAL SPA+30 SPB+0 SPC+0 TURN MB MAX FMAX SEQ-
44 CALL PGM TNC:\\SUB.H
45 TOOL CALL "MILL; D10" Z S5000
46 L X+0 Y+0 Z+50 R0 FMAX M126
47 L C+90 F3000
48 STOP M9
49 /L M30
50 END PGM BLADE MM
"#;
