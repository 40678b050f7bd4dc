//! Holder of a tool, and the gauge length of the assembly.

use facemill_tool_model::Section;

use crate::fields::{Fields, LEAST_DIAMETER_MM, LengthUnit, ROUNDING, rounded};
use crate::profile::segments;
use crate::remarks::ToolRemarks;

/// Holder from its nose up, and its length to the gauge line, mm.
///
/// `stick_out` is the length below the holder, mm, where it has no fault.
pub(crate) fn holder(
    tool: &Fields<'_>,
    geometry: &Fields<'_>,
    tool_unit: LengthUnit,
    stick_out: Option<f64>,
    remarks: &mut ToolRemarks,
) -> Option<(Vec<Section>, f64)> {
    let before = remarks.faults.len();
    let holder = tool.part("holder", &mut remarks.faults);
    if holder.is_missing() {
        if remarks.faults.len() == before {
            remarks.fault("holder", "is missing; give the tool its holder in Fusion");
        }
        return None;
    }
    let own_unit = holder.unit(remarks);
    if remarks.faults.len() > before {
        return None;
    }
    let unit = own_unit.unwrap_or(tool_unit);
    let mut sections = segments(&holder, unit, &mut remarks.faults);
    if sections.is_empty() {
        if remarks.faults.len() == before {
            remarks.fault("holder.segments", "has no segment with a height; draw the holder in Fusion");
        }
        return None;
    }
    let own = holder.length("gaugeLength", unit, LEAST_DIAMETER_MM, &mut remarks.faults);
    let assembly = geometry.length("assemblyGaugeLength", tool_unit, 0.0, &mut remarks.faults);
    let assembly = assembly.filter(|length| *length > 0.0);
    tool.compare_length(
        "tool_assemblyGaugeLength",
        ("geometry.assemblyGaugeLength", assembly),
        tool_unit,
        &mut *remarks,
    );
    holder.compare_length("tool_holderGaugeLength", ("holder.gaugeLength", own), unit, remarks);
    if remarks.faults.len() > before {
        return None;
    }
    let is_confirmed = own.zip(assembly).zip(stick_out).is_some_and(|((own, assembly), stick_out)| {
        let sum = rounded(stick_out + own);
        (assembly - sum).abs() <= ROUNDING
    });
    if own_unit.is_none() {
        if !is_confirmed {
            remarks.fault("holder.unit", unconfirmed_unit(own, assembly, stick_out, unit));
            return None;
        }
        let note = format!(
            "the holder has no unit; in the tool's, {}, its gaugeLength agrees with geometry.assemblyGaugeLength",
            unit.symbol()
        );
        remarks.note(note);
    }
    let gauge = gauge_above_nose(own, assembly, stick_out, is_confirmed, remarks)?;
    fit_to_gauge(&mut sections, gauge, own.is_some(), remarks).map(|gauge| (sections, gauge))
}

/// Returns why a holder without a unit cannot be taken to have the tool's.
fn unconfirmed_unit(own: Option<f64>, assembly: Option<f64>, stick_out: Option<f64>, unit: LengthUnit) -> String {
    match (own, assembly, stick_out) {
        (Some(own), Some(assembly), Some(stick_out)) => format!(
            "is missing, and with the tool's unit, {}, the gauge length is {} mm, but geometry.assemblyGaugeLength is \
             {assembly} mm; enter the holder's unit",
            unit.symbol(),
            rounded(stick_out + own)
        ),
        _ => "is missing, and gaugeLength and geometry.assemblyGaugeLength do not both confirm the tool's; enter the \
              holder's unit"
            .to_owned(),
    }
}

/// Length from the nose to the gauge line, mm: of the holder, else what the assembly has above the
/// tool, else none (`Some(None)`). Both must agree.
fn gauge_above_nose(
    own: Option<f64>,
    assembly: Option<f64>,
    stick_out: Option<f64>,
    is_confirmed: bool,
    remarks: &mut ToolRemarks,
) -> Option<Option<f64>> {
    let (Some(assembly), Some(stick_out)) = (assembly, stick_out) else { return Some(own) };
    let key = "geometry.assemblyGaugeLength";
    let Some(own) = own else {
        let above = rounded(assembly - stick_out);
        if above < LEAST_DIAMETER_MM {
            let fault = format!(
                "is {assembly} mm, no more than the length below the holder, {stick_out} mm; enter the holder's gauge \
                 length"
            );
            remarks.fault(key, fault);
            return None;
        }
        return Some(Some(above));
    };
    if !is_confirmed {
        let fault = format!(
            "is {assembly} mm, but geometry.LB and holder.gaugeLength make {} mm; correct the wrong one in Fusion",
            rounded(stick_out + own)
        );
        remarks.fault(key, fault);
        return None;
    }
    Some(Some(own))
}

/// Compares the gauge line with the end of the segments, and returns its height above the nose, mm.
fn fit_to_gauge(sections: &mut [Section], gauge: Option<f64>, is_own: bool, remarks: &mut ToolRemarks) -> Option<f64> {
    let total: f64 = sections.iter().map(|s| s.length_mm).sum();
    let Some(gauge) = gauge else {
        let reason = "the gauge line is at the end of the holder's last segment; the library has neither \
                      holder.gaugeLength nor geometry.assemblyGaugeLength";
        remarks.assume("gauge_length_mm", reason);
        return Some(total);
    };
    if gauge > total + ROUNDING {
        let key = if is_own { "holder.gaugeLength" } else { "geometry.assemblyGaugeLength" };
        let fault = format!(
            "puts the gauge line {gauge} mm above the nose, but the segments end at {} mm; draw the rest of the holder",
            rounded(total)
        );
        remarks.fault(key, fault);
        return None;
    }
    if gauge > total {
        // The open rest is rounding, and belongs to the last segment.
        if let Some(last) = sections.last_mut() {
            last.length_mm = rounded(last.length_mm + gauge - total);
        }
    } else if gauge + ROUNDING < total {
        let above = rounded(total - gauge);
        remarks.note(format!("the holder's segments go on {above} mm above the gauge line, inside the spindle"));
    }
    Some(gauge)
}
