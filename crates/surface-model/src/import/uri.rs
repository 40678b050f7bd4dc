/// Returns the bytes of a `data:` address in base64; `None` for another kind of address, an error
/// for a broken one.
pub(super) fn embedded(uri: &str) -> Option<Result<Vec<u8>, String>> {
    let data = uri.get(..5).filter(|scheme| scheme.eq_ignore_ascii_case("data:")).map(|_| &uri[5..])?;
    let Some((kind, data)) = data.split_once(',') else { return Some(Err("it has no comma before the data".into())) };
    if !kind.to_ascii_lowercase().ends_with(";base64") {
        return Some(Err("its data is not in base64".into()));
    }
    Some(base64(data.as_bytes()))
}

/// Decodes base64 in the standard or the URL alphabet, padded or not (RFC 4648).
fn base64(text: &[u8]) -> Result<Vec<u8>, String> {
    let end = text.iter().rposition(|&b| b != b'=').map_or(0, |k| k + 1);
    let mut bytes = Vec::with_capacity(end / 4 * 3 + 2);
    let (mut bits, mut n_bits) = (0u32, 0);
    for (k, &b) in text[..end].iter().enumerate() {
        let digit = match b {
            b'A'..=b'Z' => b - b'A',
            b'a'..=b'z' => b - b'a' + 26,
            b'0'..=b'9' => b - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return Err(format!("character {k} of its data is not base64")),
        };
        bits = bits << 6 | u32::from(digit);
        n_bits += 6;
        if n_bits >= 8 {
            n_bits -= 8;
            bytes.push((bits >> n_bits) as u8);
            bits &= (1 << n_bits) - 1;
        }
    }
    // Four digits make three bytes; a single one left over makes none.
    if end % 4 == 1 { Err("its data ends within a base64 digit group".into()) } else { Ok(bytes) }
}

/// Decodes `%20` and the like in a relative address to a file name.
pub(super) fn percent_decoded(uri: &str) -> String {
    let bytes = uri.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut k = 0;
    while k < bytes.len() {
        let hex = bytes.get(k + 1..k + 3).and_then(|h| std::str::from_utf8(h).ok());
        match hex.and_then(|h| u8::from_str_radix(h, 16).ok()) {
            Some(b) if bytes[k] == b'%' => {
                out.push(b);
                k += 3;
            }
            _ => {
                out.push(bytes[k]);
                k += 1;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

#[cfg(test)]
#[path = "../../tests/unit/import/uri.rs"]
mod tests;
