//! Columns of tables: their names, quantities and units.

/// A table of a propeller file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TableKind {
    /// One row per radius.
    Radial,
    /// One row per station of each section.
    Sections,
}

impl TableKind {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Radial => "radial table",
            Self::Sections => "table of sections",
        }
    }
}

/// Quantity of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    Radius,
    Chord,
    Pitch,
    Thickness,
    Camber,
    Skew,
    Rake,
    /// Chord fraction from the leading edge.
    Station,
    /// Height of the suction side.
    Suction,
    /// Height of the pressure side.
    Pressure,
}

impl Quantity {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Radius => "radius",
            Self::Chord => "chord",
            Self::Pitch => "pitch",
            Self::Thickness => "thickness",
            Self::Camber => "camber",
            Self::Skew => "skew",
            Self::Rake => "rake",
            Self::Station => "station along the chord",
            Self::Suction => "suction side",
            Self::Pressure => "pressure side",
        }
    }
}

/// Form of a column's values; where a table has a quantity in several, the first of these is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ColumnForm {
    /// A length: mm in one unit of the column.
    Length(f64),
    /// Distance of the leading edge from the generator line along the helix, of the skew.
    LeadingEdge(f64),
    OverRadius,
    OverDiameter,
    OverChord,
    Radians,
    Degrees,
}

impl ColumnForm {
    /// Place in the order of preference.
    pub(crate) fn rank(self) -> u8 {
        match self {
            Self::Length(_) | Self::LeadingEdge(_) => 0,
            Self::OverDiameter => 1,
            Self::OverRadius => 2,
            Self::OverChord => 3,
            Self::Radians => 4,
            Self::Degrees => 5,
        }
    }
}

/// Units of lengths by the end of a name, mm.
pub(crate) const UNITS: [(&str, f64); 4] = [("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("in", 25.4)];

/// Columns without a unit of length.
const RATIOS: [(TableKind, &str, Quantity, ColumnForm); 23] = {
    use ColumnForm::{Degrees, OverChord, OverDiameter, OverRadius, Radians};
    use TableKind::{Radial, Sections};
    [
        (Radial, "r_R", Quantity::Radius, OverRadius),
        (Radial, "c_D", Quantity::Chord, OverDiameter),
        (Radial, "P_D", Quantity::Pitch, OverDiameter),
        (Radial, "phi_deg", Quantity::Pitch, Degrees),
        (Radial, "t_c", Quantity::Thickness, OverChord),
        (Radial, "t_D", Quantity::Thickness, OverDiameter),
        (Radial, "f_c", Quantity::Camber, OverChord),
        (Radial, "skew_deg", Quantity::Skew, Degrees),
        (Radial, "skew_rad", Quantity::Skew, Radians),
        (Radial, "rake_D", Quantity::Rake, OverDiameter),
        (Radial, "rake_R", Quantity::Rake, OverRadius),
        (Sections, "r_R", Quantity::Radius, OverRadius),
        (Sections, "x_c", Quantity::Station, OverChord),
        (Sections, "suction_c", Quantity::Suction, OverChord),
        (Sections, "upper_c", Quantity::Suction, OverChord),
        (Sections, "back_c", Quantity::Suction, OverChord),
        (Sections, "pressure_c", Quantity::Pressure, OverChord),
        (Sections, "lower_c", Quantity::Pressure, OverChord),
        (Sections, "face_c", Quantity::Pressure, OverChord),
        (Sections, "t_c", Quantity::Thickness, OverChord),
        (Sections, "thickness_c", Quantity::Thickness, OverChord),
        (Sections, "f_c", Quantity::Camber, OverChord),
        (Sections, "camber_c", Quantity::Camber, OverChord),
    ]
};

/// Columns of lengths, without their unit.
const LENGTHS: [(TableKind, &str, Quantity); 21] = {
    use TableKind::{Radial, Sections};
    [
        (Radial, "r", Quantity::Radius),
        (Radial, "radius", Quantity::Radius),
        (Radial, "chord", Quantity::Chord),
        (Radial, "pitch", Quantity::Pitch),
        (Radial, "thickness", Quantity::Thickness),
        (Radial, "max_thick", Quantity::Thickness),
        (Radial, "camber", Quantity::Camber),
        (Radial, "max_camber", Quantity::Camber),
        (Radial, LEADING_EDGE, Quantity::Skew),
        (Radial, "dist_lead_edge", Quantity::Skew),
        (Radial, "rake", Quantity::Rake),
        (Sections, "r", Quantity::Radius),
        (Sections, "radius", Quantity::Radius),
        (Sections, "suction", Quantity::Suction),
        (Sections, "upper", Quantity::Suction),
        (Sections, "back", Quantity::Suction),
        (Sections, "pressure", Quantity::Pressure),
        (Sections, "lower", Quantity::Pressure),
        (Sections, "face", Quantity::Pressure),
        (Sections, "thickness", Quantity::Thickness),
        (Sections, "camber", Quantity::Camber),
    ]
};

const LEADING_EDGE: &str = "leading_edge";

/// Returns quantity and form of a column by its name, in any case, with `/` or `_`.
pub(crate) fn column_named(kind: TableKind, name: &str) -> Option<(Quantity, ColumnForm)> {
    let name = name.trim().replace('/', "_");
    let ratio = RATIOS.iter().find(|(table, known, ..)| *table == kind && known.eq_ignore_ascii_case(&name));
    if let Some(&(_, _, quantity, form)) = ratio {
        return Some((quantity, form));
    }
    let (base, unit) = name.rsplit_once('_')?;
    let mm = UNITS.iter().find(|(known, _)| known.eq_ignore_ascii_case(unit))?.1;
    let (_, _, quantity) =
        LENGTHS.iter().find(|(table, known, _)| *table == kind && known.eq_ignore_ascii_case(base))?;
    let form = if *quantity == Quantity::Skew { ColumnForm::LeadingEdge(mm) } else { ColumnForm::Length(mm) };
    Some((*quantity, form))
}

/// Returns the names of the columns of a table that have a quantity, lengths in mm.
pub(crate) fn columns_of(kind: TableKind, quantity: Quantity) -> String {
    let ratios = RATIOS.iter().filter(|(table, _, q, _)| *table == kind && *q == quantity);
    let lengths = LENGTHS.iter().filter(|(table, _, q)| *table == kind && *q == quantity);
    let names: Vec<String> = ratios
        .map(|(_, name, ..)| (*name).to_owned())
        .chain(lengths.map(|(_, name, _)| format!("{name}_mm")))
        .collect();
    names.join(", ")
}

/// Returns the known column nearest to a name, and all known ones.
pub(crate) fn nearest_column(kind: TableKind, name: &str) -> (&'static str, String) {
    let name = name.trim().replace('/', "_").to_lowercase();
    // A unit at the end says nothing of which length it is.
    let base = name.rsplit_once('_').filter(|(_, unit)| UNITS.iter().any(|(known, _)| known == unit));
    let base = base.map_or(name.as_str(), |(base, _)| base);
    let ratios = RATIOS.iter().filter(|(table, ..)| *table == kind).map(|(_, known, ..)| (*known, name.as_str()));
    let lengths = LENGTHS.iter().filter(|(table, ..)| *table == kind).map(|(_, known, _)| (*known, base));
    let distance = |(known, given): &(&'static str, &str)| strsim::damerau_levenshtein(&known.to_lowercase(), given);
    let nearest = ratios.chain(lengths).min_by_key(distance).map_or("r_R", |(known, _)| known);
    let ratios = RATIOS.iter().filter(|(table, ..)| *table == kind).map(|(_, known, ..)| (*known).to_owned());
    let lengths = LENGTHS.iter().filter(|(table, ..)| *table == kind).map(|(_, known, _)| format!("{known}_mm"));
    (nearest, ratios.chain(lengths).collect::<Vec<_>>().join(", "))
}
