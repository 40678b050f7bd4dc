//! Short programs of every dialect, with the features of real ones.

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
