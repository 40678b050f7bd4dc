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
    vec![Sample { name: "fanuc", text: FANUC, read: |text| read_fanuc(text) }]
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
