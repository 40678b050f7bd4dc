//! Files of a page: one document with data, style and script.

use crate::document::PageData;
use crate::format::{PageDocument, VerdictState};
use crate::verdict::stamp_line;

/// Script of the page, made from `page/src` by `npm run build` there.
const SCRIPT: &str = include_str!("../page/dist/report.js");
/// Script of the setup sheet alone.
const SHEET_SCRIPT: &str = include_str!("../page/dist/sheet.js");
/// Style of both.
pub(crate) const STYLE: &str = include_str!("../page/src/style.css");
/// SHA-256 of both scripts as base64, which the content security policy names.
const SCRIPT_SHA256: &str = include_str!("../page/dist/report.js.sha256");
/// The same of the sheet's script.
const SHEET_SHA256: &str = include_str!("../page/dist/sheet.js.sha256");

/// Returns the page as a file that opens from disk, without any access to a network.
#[must_use]
pub fn report_html(data: &PageData) -> Vec<u8> {
    html(&data.document, &data.arrays.texts(), ("report", SCRIPT, SCRIPT_SHA256))
}

/// Returns the setup sheet alone, as a file that opens from disk and prints on A4.
#[must_use]
pub fn sheet_html(data: &PageData) -> Vec<u8> {
    // It shows none of the maps, of which there may be many.
    let document = PageDocument { postures: None, ..data.document.clone() };
    html(&document, &[], ("setup sheet", SHEET_SCRIPT, SHEET_SHA256))
}

fn html(document: &PageDocument, arrays: &[String], (what, script, sha256): (&str, &str, &str)) -> Vec<u8> {
    let verdict = &document.verdict;
    let rejected = if verdict.state == VerdictState::Faulty { "REJECTED - " } else { "" };
    let title = escaped(&format!("{rejected}{} - {} - {what}", document.job, document.setup.file.name));
    let stamp = escaped(&stamp_line(verdict));
    let policy = format!(
        "default-src 'none'; script-src 'sha256-{}'; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'",
        sha256.trim()
    );
    // Within a data block no `<` may stand: it could end the block.
    let json = serde_json::to_string(document).unwrap_or_default().replace('<', "\\u003c");
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta http-equiv=\"Content-Security-Policy\" \
         content=\"{policy}\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n<noscript><p><b>{stamp}</b></p><p>This page needs scripts.</p></noscript>\n<div id=\"app\"></div>\n\
         <script type=\"application/json\" id=\"document\">{json}</script>\n"
    );
    for (k, array) in arrays.iter().enumerate() {
        out += &format!("<script type=\"text/plain\" id=\"array-{k}\">{array}</script>\n");
    }
    out += &format!("<script>{script}</script>\n</body>\n</html>\n");
    out.into_bytes()
}

/// Returns text for HTML.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
