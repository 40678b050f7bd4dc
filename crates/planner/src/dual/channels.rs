//! The program of two heads as two channel programs for Siemens 840D.

use facemill_channel_pair::{SiemensSettings, write_siemens_pair};
use facemill_job::failure::Failure;
use facemill_nc_program::{HeadSpec, PostSettings, ProgramSpec};

/// Returns the blocks of the program in one channel as one file for each channel: names with their
/// bytes, channel 1 first.
///
/// `post` writes the program in one channel; it gives the unit of the feeds of `spec` and the
/// decimals of words. [`write_siemens_pair`] puts marks around rapids, at both ends of passes and
/// after every 50 cutting blocks; the other settings are those of [`SiemensSettings::default`].
/// Between marks each channel runs by itself, and both texts say that they are an estimate; only
/// the program in one channel is verified.
///
/// # Errors
/// Returns an error if 840D has no word for a value of the program, such as work offset 100 and
/// above.
pub(crate) fn channel_files(
    spec: &ProgramSpec,
    heads: &[HeadSpec],
    post: &PostSettings,
    suffix: &str,
    state: &str,
) -> Result<Vec<(String, Vec<u8>)>, Failure> {
    let settings =
        SiemensSettings { program_feed: post.feed_mode(), decimals: post.decimals(), ..SiemensSettings::default() };
    let pair = write_siemens_pair(spec, heads, &settings)
        .map_err(|e| Failure::Infeasible(format!("channel programs for 840D: {e}")))?;
    let named = pair.channels.into_iter().zip(1..);
    Ok(named.map(|(text, n)| (format!("program{suffix}-channel-{n}{state}.mpf"), text.into_bytes())).collect())
}

#[cfg(test)]
#[path = "../../tests/unit/dual/channels.rs"]
mod tests;
