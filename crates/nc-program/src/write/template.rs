use facemill_cl_data::RapidLaw;
use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{Environment, Error, ErrorKind, UndefinedBehavior};

use crate::dialect::file::DialectFile;
use crate::dialect::fill;
use crate::dialect::post_file::PostSettings;
use crate::program::heads::HeadSpec;
use crate::program::spec::{AxisSpec, ProgramSpec, SpindleSpec, ToolSpec};
use crate::program::write_error::WriteError;
use crate::program::{FeedMode, heads};
use crate::words::axis_words::{AxisKind, AxisWords};
use crate::words::number_text;
use crate::write::codes::{coolant_code, spindle_code, spindle_speed, work_offset};
use crate::write::context::{
    AxisContext, CodeContext, Context, FeedContext, HeadContext, JobContext, ProgramContext, RapidContext, RtcpContext,
    SectionContext, SpindleContext, ToleranceContext, ToolContext, WordsContext,
};
use crate::write::template_bounds::{SourceFault, bound, check_source};
use crate::write::text::{clean_comment, program_id, push_axis_word};

/// Stands for the motions while the template is rendered, because they can be longer than all the
/// rest together.
pub(super) const BODY: &str = "\u{1}body\u{1}";

/// Steps that a template may take: some hundred times what those that are shipped take, and seconds
/// at the longest.
const FUEL: u64 = 200_000;

/// Bytes that a template may write besides the motions.
const MOST_TEXT: usize = 4 << 20;

/// The template's lines, trimmed, without empty ones; exactly one is [`BODY`].
pub(super) fn render(
    spec: &ProgramSpec,
    heads: &[HeadSpec],
    settings: &PostSettings,
    section: SectionContext,
) -> Result<Vec<String>, WriteError> {
    let context = context(spec, heads, settings, section)?;
    let template = &settings.template;
    check_source(&template.text).map_err(|SourceFault { line, message }| WriteError::Template {
        name: template.name.clone(),
        line: Some(line),
        message,
    })?;
    let fault = |e: Error| WriteError::Template { name: template.name.clone(), line: e.line(), message: message(&e) };
    let mut environment = Environment::new();
    // A misspelt variable must not write an empty word.
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_fuel(Some(FUEL));
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build().map_err(fault)?);
    environment.set_auto_escape_callback(|_| minijinja::AutoEscape::None);
    environment.add_filter("fixed", fixed);
    bound(&mut environment);
    environment.add_template(&template.name, &template.text).map_err(fault)?;
    let rendered = environment.get_template(&template.name).map_err(fault)?;
    let mut text = Bounded(Vec::new());
    rendered.render_captured_to(Serde(&context), &mut text).map_err(fault)?;
    let text = String::from_utf8_lossy(&text.0).into_owned();
    let lines: Vec<String> = text.lines().map(|l| l.trim().to_owned()).filter(|l| !l.is_empty()).collect();
    let count = lines.iter().filter(|l| l.contains(BODY)).count();
    if count == 1 && lines.iter().any(|l| l == BODY) {
        Ok(lines)
    } else {
        Err(WriteError::TemplateBody { name: template.name.clone(), count })
    }
}

/// A fault of a template in words.
fn message(e: &Error) -> String {
    match (e.kind(), std::error::Error::source(e)) {
        (ErrorKind::OutOfFuel, _) => {
            format!("takes more than {FUEL} steps and may have no end; give its loops fewer rounds")
        }
        (ErrorKind::WriteFailure, Some(why)) => format!("{}: {why}", e.kind()),
        (kind, _) => e.detail().map_or_else(|| kind.to_string(), |d| format!("{kind}: {d}")),
    }
}

/// Text of a template, to a bound.
struct Bounded(Vec<u8>);

impl std::io::Write for Bounded {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        if self.0.len() + bytes.len() > MOST_TEXT {
            return Err(std::io::Error::other(format!("it writes more than {MOST_TEXT} bytes")));
        }
        self.0.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Filter `fixed(n)`: a number with n decimals, all written.
fn fixed(value: f64, decimals: u8) -> Result<String, Error> {
    let text = (decimals <= 6).then(|| number_text::number(value, decimals, true)).flatten();
    text.ok_or_else(|| Error::new(ErrorKind::InvalidOperation, format!("{value} with {decimals} decimals")))
}

fn context(
    spec: &ProgramSpec,
    heads: &[HeadSpec],
    settings: &PostSettings,
    section: SectionContext,
) -> Result<Context, WriteError> {
    let Some((first, true)) = spec.program.first_motion() else {
        return Err(WriteError::FirstMotion);
    };
    let approach = match settings.feed_mode {
        FeedMode::Rtcp => spec.approach.as_ref().ok_or(WriteError::NoApproach)?,
        FeedMode::G94 | FeedMode::G93 => first,
    };
    let rules = &settings.rules;
    check_axes(&spec.axes, rules)?;
    check_heads(spec, heads, settings)?;
    let clean = |text: &str| clean_comment(text, &rules.comments);
    let name = settings.program_name.as_ref().unwrap_or(&spec.job_name);
    let digits = usize::from(rules.program.digits);
    let (work_offset, work_offset_lines) = work_offset(spec.work_offset, rules, "work_offset")?;
    Ok(Context {
        program: ProgramContext {
            number: settings.program_number,
            padded: format!("{:0digits$}", settings.program_number),
            name: clean(name),
            id: program_id(name, settings.program_number, rules.program.name_length.into()),
        },
        job: JobContext { name: clean(&spec.job_name) },
        section,
        tool: tool(&spec.tool, "tool", rules)?,
        spindle: spindle(&spec.spindle, "spindle.rpm", settings)?,
        heads: heads.iter().map(|head| head_context(head, first, settings)).collect::<Result<_, _>>()?,
        coolant: CodeContext {
            code: coolant_code(spec.coolant, rules, "coolant")?,
            off: rules.words.coolant.off.clone(),
        },
        work_offset,
        work_offset_lines,
        feed: FeedContext {
            mode: settings.feed_mode,
            code: rules.feed_code(settings.feed_mode).unwrap_or_default().to_owned(),
            per_minute: rules.feed_code(FeedMode::G94).unwrap_or_default().to_owned(),
        },
        rapid: rapid(spec.rapid, rules)?,
        rtcp: rtcp(&spec.tool, settings),
        tolerance: tolerance(settings),
        blending: settings.blending()?,
        look_ahead: settings.look_ahead(),
        axes: spec.axes.iter().map(|axis| axis_context(axis, settings)).collect(),
        home: home(&spec.axes, settings)?,
        reference: reference(&spec.axes, settings)?,
        first: position(first, &spec.axes, settings, "the first motion")?,
        approach: position(approach, &spec.axes, settings, "the approach")?,
        body: BODY,
    })
}

fn rapid(law: RapidLaw, rules: &DialectFile) -> Result<RapidContext, WriteError> {
    let linear = law == RapidLaw::Linear;
    let rule = rules.rapid(linear).ok_or_else(|| WriteError::Rapid { name: rules.name.clone(), linear })?;
    Ok(RapidContext { linear, code: rule.code.clone(), note: clean_comment(&rule.note, &rules.comments) })
}

fn rtcp(tool: &ToolSpec, settings: &PostSettings) -> RtcpContext {
    let Some(rule) = settings.rules.motion.rtcp.as_ref().filter(|_| settings.feed_mode == FeedMode::Rtcp) else {
        return RtcpContext::default();
    };
    let register = tool.length_register.to_string();
    let values = [("register", register.as_str()), ("law", settings.law_code())];
    RtcpContext {
        law: settings.rtcp_law().map(|l| l.law),
        code: settings.law_code().to_owned(),
        before: rule.on.before.iter().map(|line| fill(line, &values)).collect(),
        off: rule.off.clone(),
        vectors: settings.orientation == crate::dialect::post_file::Orientation::Vectors,
    }
}

fn tolerance(settings: &PostSettings) -> ToleranceContext {
    let allowed = settings.control_tolerance();
    ToleranceContext { path: allowed.path, orientation: allowed.orientation.to_degrees() }
}

fn check_axes(axes: &[AxisSpec], rules: &DialectFile) -> Result<(), WriteError> {
    if let Some(axis) = axes.iter().find(|a| a.letter.number() > 0 && !rules.numbers.numbered_axes) {
        let what = "axes with a number".to_owned();
        return Err(WriteError::NotInDialect {
            place: format!("axis {}", axis.letter),
            what,
            name: rules.name.clone(),
        });
    }
    match axes.iter().enumerate().find(|(k, axis)| axes[..*k].iter().any(|other| other.letter == axis.letter)) {
        Some((_, axis)) => Err(WriteError::TwoAxes(axis.letter)),
        None => Ok(()),
    }
}

/// Heads that one program can be written for.
fn check_heads(spec: &ProgramSpec, all: &[HeadSpec], settings: &PostSettings) -> Result<(), WriteError> {
    if all.is_empty() {
        return Ok(());
    }
    if !settings.rules.several_heads {
        let (what, name) = ("several heads in one program".to_owned(), settings.rules.name.clone());
        return Err(WriteError::NotInDialect { place: "heads".to_owned(), what, name });
    }
    heads::check_heads(spec, all)?;
    if settings.feed_mode == FeedMode::Rtcp { Err(WriteError::RtcpOfHeads) } else { Ok(()) }
}

fn head_context(head: &HeadSpec, first: &AxisWords, settings: &PostSettings) -> Result<HeadContext, WriteError> {
    let axis = head.spindle_axis;
    let missing = || WriteError::FirstMotionOfHead { head: head.name.clone(), axis };
    let value = first.get(axis).ok_or_else(missing)?;
    let units = number_text::units(value, settings.decimals.of(axis.kind()));
    let place = || "the first motion".to_owned();
    let units = units.ok_or_else(|| WriteError::Number { place: place(), what: "an axis word", value })?;
    let mut word = String::new();
    push_axis_word(&mut word, axis, units, settings);
    Ok(HeadContext {
        name: clean_comment(&head.name, &settings.rules.comments),
        tool: tool(&head.tool, &format!("tool of head {}", head.name), &settings.rules)?,
        spindle: spindle(&head.spindle, &format!("spindle.rpm of head {}", head.name), settings)?,
        spindle_number: head.spindle_number,
        spindle_axis: axis,
        first: word,
    })
}

fn tool(tool: &ToolSpec, place: &str, rules: &DialectFile) -> Result<ToolContext, WriteError> {
    let lengths = [("radius", tool.radius), ("corner_radius", tool.corner_radius), ("length", tool.length)];
    for (field, value) in lengths {
        if number_text::units(value, 3).is_none() {
            return Err(WriteError::Number { place: format!("{place}.{field}"), what: "a length", value });
        }
    }
    Ok(ToolContext {
        number: tool.number,
        name: clean_comment(&tool.name, &rules.comments),
        radius: tool.radius,
        corner_radius: tool.corner_radius,
        length: tool.length,
        length_register: tool.length_register,
    })
}

fn spindle(spindle: &SpindleSpec, place: &str, settings: &PostSettings) -> Result<SpindleContext, WriteError> {
    let (rpm, clockwise) = (spindle.rpm, spindle.clockwise);
    Ok(SpindleContext { rpm: spindle_speed(rpm, place)?, clockwise, code: spindle_code(spindle, settings) })
}

fn axis_context(axis: &AxisSpec, settings: &PostSettings) -> AxisContext {
    let kind = axis.letter.kind();
    let limit = |value| number_text::number(value, settings.decimals.of(kind), settings.trailing_zeros);
    AxisContext {
        letter: axis.letter,
        rotary: kind == AxisKind::Rotary,
        along_spindle: axis.along_spindle,
        min: limit(axis.min),
        max: limit(axis.max),
        work_offset: limit(axis.work_offset),
    }
}

fn home(axes: &[AxisSpec], settings: &PostSettings) -> Result<WordsContext, WriteError> {
    let mut words = WordsContext::default();
    for axis in axes {
        add_word(&mut words, axis, 0.0, settings, "home")?;
    }
    Ok(words)
}

/// `None` where no machine has been said.
fn reference(axes: &[AxisSpec], settings: &PostSettings) -> Result<Option<WordsContext>, WriteError> {
    if settings.home.is_none() {
        return Ok(None);
    }
    let mut words = WordsContext::default();
    for axis in axes {
        add_word(&mut words, axis, settings.home_of(axis.letter)?, settings, "the reference position")?;
    }
    Ok(Some(words))
}

fn position(
    words: &AxisWords,
    axes: &[AxisSpec],
    settings: &PostSettings,
    place: &str,
) -> Result<WordsContext, WriteError> {
    let mut all = WordsContext::default();
    for word in words.iter() {
        let axis = axes.iter().find(|axis| axis.letter == word.letter);
        let axis = axis.ok_or_else(|| WriteError::NoSuchAxis { place: place.to_owned(), letter: word.letter })?;
        add_word(&mut all, axis, word.value, settings, place)?;
    }
    Ok(all)
}

fn add_word(
    words: &mut WordsContext,
    axis: &AxisSpec,
    value: f64,
    settings: &PostSettings,
    place: &str,
) -> Result<(), WriteError> {
    let decimals = settings.decimals.of(axis.letter.kind());
    let units = number_text::units(value, decimals);
    let units = units.ok_or_else(|| WriteError::Number { place: place.to_owned(), what: "an axis word", value })?;
    let groups: &mut [&mut String] = match (axis.letter.kind(), axis.along_spindle) {
        (AxisKind::Rotary, _) => &mut [&mut words.rotary, &mut words.all],
        (AxisKind::Linear, true) => &mut [&mut words.spindle, &mut words.linear, &mut words.all],
        (AxisKind::Linear, false) => &mut [&mut words.across, &mut words.linear, &mut words.all],
    };
    for group in groups {
        if !group.is_empty() {
            group.push(' ');
        }
        push_axis_word(group, axis.letter, units, settings);
    }
    Ok(())
}
