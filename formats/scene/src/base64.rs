//! Bytes as text (RFC 4648, §4).

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// The bytes of a text, whose line breaks and blanks do not count; none if it is not base64.
pub fn decode(text: &str) -> Option<Vec<u8>> {
    if text.bytes().any(|b| b.is_ascii_whitespace()) {
        let joined: String = text.split_ascii_whitespace().collect();
        return STANDARD.decode(joined).ok();
    }
    STANDARD.decode(text).ok()
}

/// Bytes as text.
pub fn encode(bytes: &[u8]) -> String {
    STANDARD.encode(bytes)
}
