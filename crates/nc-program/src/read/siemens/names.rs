//! Names of Siemens 840D and their meanings.

use crate::read::unfollowed::Cause;

const CORNER: &str = "a rounded or chamfered corner is not followed";

pub(super) const TOOL_ANGLES: &str = "angles of the tool instead of a vector are not followed";

const OWN_WAY: &str = "an axis that goes its own way is not followed";

/// Effect of a name on the reader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Name {
    /// It changes how a path is kept or what is shown, not where it goes.
    Mode,
    /// TRAORI.
    TransformationOn,
    /// TRAFOOF.
    TransformationOff,
    /// The frame that words count in; axis words of the block belong to it.
    Frame,
    /// Words of the block are machine values.
    Machine,
    /// The blocks that follow call a cycle or subprogram.
    ModalCall,
    /// A setting of the tool or the axes that words depend on.
    Setting,
    /// The spindle is turned to an angle.
    SpindlePosition,
    /// Turns of an arc.
    Turns,
    /// Radius of an arc.
    Radius,
    /// Angle of an arc.
    Angle,
    /// Number of the fixed point (G75).
    FixedPoint,
    /// End of a subprogram.
    Return,
    /// The words of the block are not followed, for this reason.
    NotFollowed(Cause, &'static str),
}

/// Names that change how a path is kept, how fast, and what is shown; and those that declare. They
/// are kept as they stand.
const MODES: &str = "\
    ACC ACCLIMA ADIS ADISPOS ATOL BLSYNC BRISK BRISKA CDOF CDOF2 CFC CFIN CFTCP COMPCAD COMPCURV COMPOF COMPON \
    COMPPATH COMPSURF CTOL CUT2D CUT2DF CUT3DC CUT3DF CUT3DFF CUT3DFS CUTCONOF DIAMCYCOF DIAMOF DISPLOF DISPLON \
    DRIVE DRIVEA DYNFINISH DYNNORM DYNPOS DYNPREC DYNROUGH DYNSEMIFIN FA FCUB FENDNORM FFWOF FFWON FGREF FGROUP \
    FIFOCTRL FL FLIN FNORM FRC FRCM G0TOF G0TOL GROUP_BEGIN GROUP_END JERKLIM JERKLIMA KONT KONTC KONTT LIMS NORM \
    ORIANGLE ORIAXES ORIAXPOS ORIC ORICONIO ORICURVE ORID ORIEULER ORIMKS ORIPATH ORIPATHS ORIPLANE ORIRPY ORIRPY2 \
    ORISOF ORISON ORIVECT ORIVIRT1 ORIVIRT2 ORIWKS OSC OSD OSOF OSS OSSE OST OTOL OVR OVRA OVRRAP RTLIOF RTLION SAVE \
    SBLOF SBLON SD SOFT SOFTA SPATH STARTFIFO STOLF STOPFIFO STOPRE TILTOF UPATH VELOLIM VELOLIMA WAITE WAITM WAITMC \
    WAITP WAITS WALIMOF WALIMON WORKPIECE CLEARM SETM MEAC FB FD FZ SVC FMA FPR FPRAON FPRAOF FAD";

/// Words of the control that a program assigns to, and that are not followed: no variables,
/// whatever they set. They end a motion elsewhere (FXS), shift the path (OFFN), couple axes (CP…),
/// join or lift off (DISR, POLF), choose a posture (STAT, TU) or change the tool (CUTMOD).
const NOT_FOLLOWED: &str = "\
    ALF ASUBST BNAT COARSEA CPBC CPDEF CPDEL CPFMOF CPFMON CPFMSON CPFPOS CPFRS CPLA CPLCTID CPLDEF CPLDEL CPLDEN \
    CPLDYPRIO CPLDYVLL CPLDYVLU CPLINSC CPLINTR CPLNUM CPLOF CPLON CPLOUTSC CPLOUTTR CPLPOS CPLSETVAL CPMALARM CPMBRAKE \
    CPMPRT CPMRESET CPMSTART CPMVDI CPOF CPON CPRES CPSETTYPE CPSYNCOP CPSYNCOP2 CPSYNCOV CPSYNFIP CPSYNFIP2 CPSYNFIV \
    CUTMOD CUTMODK DIACYCOFA DIAMCHAN DIAMCHANA DIC DISC DISCL DISR DISRP DITE DITS FINEA FLIM FOC FOCON FOCOF FXS \
    FXST FXSW IPOBRKA IPOENDA ISD LFPOS LFTXT LFWP LIFTFAST MOV NUT OFFN OS OSB OSCILL OSCTRL OSE OSNSC \
    OSP1 OSP2 OST1 OST2 PL PO POLF POLFA POLFMASK POLFMLIN PUTFTOC PW RMBBL RMEBL RMIBL RMNBL SCC SCPARA SETMS SF SPINU \
    SPIF1 SPIF2 SPN SPP SR SRA ST STA STAT TANG TCOFRX TCOFRY TCOFRZ TLIFT TMOF TMON TOFF TU XH YH ZH";

const FRAMES: &str = "\
    TRANS ATRANS ROT AROT ROTS AROTS CROTS SCALE ASCALE MIRROR AMIRROR TOFRAME TOFRAMEX TOFRAMEY TOFRAMEZ TOROT \
    TOROTX TOROTY TOROTZ TOROTOF PAROT CTRANS CROT MEAFRAME PAROTOF";

/// Returns the meaning of a name; `None` for one that the control does not have, or a subprogram.
pub(super) fn meaning(name: &str) -> Option<Name> {
    let plain = name.split('[').next().unwrap_or(name);
    Some(match plain {
        "TRAORI" => Name::TransformationOn,
        "TRAFOOF" => Name::TransformationOff,
        "SUPA" => Name::Machine,
        "MCALL" => Name::ModalCall,
        "TURN" => Name::Turns,
        "CR" => Name::Radius,
        "AR" => Name::Angle,
        "FP" => Name::FixedPoint,
        "RET" => Name::Return,
        "SPOS" | "SPOSA" | "SPCON" => Name::SpindlePosition,
        "GFRAME0" | "PUTFTOCF" | "SUPD" | "TCOFR" | "FTOCON" | "FTOCOF" | "DL" | "TOWSTD" | "TOWMCS" | "TOWWCS"
        | "TOWBCS" | "TOWTCS" | "TOWKCS" | "TOFFON" | "TOFFOF" | "TOFFL" | "TOFFR" | "TCARR" | "TCOABS"
        | "PRESETON" | "PRESETONS" | "DIAMON" | "DIAM90" | "TRAFOON" | "TRACON" => Name::Setting,
        "ASPLINE" | "BSPLINE" | "CSPLINE" | "POLY" | "INVCW" | "INVCCW" | "CIP" | "CT" => Name::NotFollowed(
            Cause::Path,
            "a spline, or an arc that neither a centre nor a radius tells, is not followed",
        ),
        "RNDM" => Name::NotFollowed(Cause::Corners, CORNER),
        "RND" | "CHF" | "CHR" => Name::NotFollowed(Cause::Corner, CORNER),
        "LEAD" | "TILT" | "THETA" | "PHI" | "PSI" | "ORIROTA" | "ORIROTR" | "ORIROTT" | "ORIROTC" => {
            Name::NotFollowed(Cause::Block, TOOL_ANGLES)
        }
        "ORIRESET" => Name::NotFollowed(Cause::Block, "ORIRESET turns the tool: it is not followed"),
        "AP" | "RP" | "ANG" => Name::NotFollowed(Cause::Block, "polar words are not followed"),
        "GEOAX" => Name::NotFollowed(Cause::Forever, "axes of another name are not followed"),
        "TRACYL" | "TRANSMIT" | "TRAANG" => Name::NotFollowed(Cause::Mapping, OWN_WAY),
        "TRAILON" => Name::NotFollowed(Cause::Forever, OWN_WAY),
        "MEAS" | "MEAW" | "MEASA" | "MEAWA" => {
            Name::NotFollowed(Cause::Block, "a move that a probe ends is not followed")
        }
        "POS" | "POSA" | "POSP" | "OEMIPO1" => Name::NotFollowed(Cause::Block, OWN_WAY),
        _ if FRAMES.split(' ').any(|name| name == plain) => Name::Frame,
        _ if MODES.split(' ').any(|name| name == plain) => Name::Mode,
        _ => return None,
    })
}

/// Whether a name is a word of the control that is assigned to, and not followed.
pub(super) fn is_not_followed(name: &str) -> bool {
    let plain = name.split('[').next().unwrap_or(name);
    NOT_FOLLOWED.split_ascii_whitespace().any(|word| word == plain)
}

/// How a statement that begins with a name is read as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Statement {
    /// It may skip or repeat others.
    Branch,
    /// DEF: variables.
    Definition,
    /// A heading that moves nothing.
    Heading,
    /// MSG.
    Message,
    /// Text to a file.
    Output,
    /// SETAL.
    Alarm,
    /// A subprogram, named behind it.
    Call,
}

/// The statement that a name begins.
pub(super) fn statement(name: &str) -> Option<Statement> {
    Some(match name {
        "IF" | "ELSE" | "ENDIF" | "WHILE" | "ENDWHILE" | "FOR" | "ENDFOR" | "LOOP" | "ENDLOOP" | "REPEAT"
        | "REPEATB" | "UNTIL" | "CASE" | "GOTO" | "GOTOF" | "GOTOB" | "GOTOC" | "GOTOS" | "WHEN" | "WHENEVER"
        | "EVERY" | "FROM" | "DO" | "ID" | "IDS" | "SETINT" => Statement::Branch,
        "DEF" | "REDEF" => Statement::Definition,
        "PROC" | "EXTERN" => Statement::Heading,
        "MSG" => Statement::Message,
        "WRITE" | "DELETE" | "EXTOPEN" | "EXTCLOSE" => Statement::Output,
        "SETAL" => Statement::Alarm,
        "CALL" | "PCALL" | "ISOCALL" | "EXTCALL" | "INIT" | "START" => Statement::Call,
        _ => return None,
    })
}

/// The number of a drilling cycle whose positions are those of the blocks behind MCALL.
pub(super) fn drilling_code(name: &str) -> Option<u8> {
    let code: u16 = name.strip_prefix("CYCLE")?.parse().ok()?;
    match code {
        81..=89 => u8::try_from(code).ok(),
        // With a compensating chuck.
        840 => Some(84),
        _ => None,
    }
}

/// Whether a name is that of a cycle of the control.
pub(super) fn is_cycle(name: &str) -> bool {
    let is_numbered = |start: &str| {
        name.strip_prefix(start).is_some_and(|rest| !rest.is_empty() && rest.bytes().all(|b| b.is_ascii_digit()))
    };
    ["CYCLE", "POCKET", "HOLES", "SLOT"].into_iter().any(is_numbered)
        || matches!(name, "LONGHOLE" | "CONTPRON" | "CONTDCON" | "EXECUTE" | "CUST_TECHCYC" | "CUST_MULTICHAN")
}

/// Whether a cycle changes how a path is kept and nothing else.
pub(super) fn is_path_cycle(name: &str) -> bool {
    name == "CYCLE832"
}
