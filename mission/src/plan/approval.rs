//! Who allowed a critical command beforehand, and exactly which.

use protocol::Telecommand;
use sha2::{Digest as _, Sha256};

use crate::clock::UtcUs;
use crate::id::Principal;

/// Somebody allows telecommands before they are needed: at 3 a.m. nobody is there to confirm them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Approval {
    /// Who.
    pub by: Principal,
    /// Exactly which telecommands, by their [`digest`]; `None`: those of the step, whatever they are.
    pub digest: Option<String>,
    /// Not after this.
    pub expires_at: Option<UtcUs>,
}

/// What an approval is bound to: 16 hex digits of SHA-256 over type and payload of each telecommand. Another argument
/// is another digest.
pub fn digest(telecommands: &[Telecommand]) -> String {
    let mut hash = Sha256::new();
    for telecommand in telecommands {
        let mut payload = [0; protocol::UP_PAYLOAD_MAX];
        let len = telecommand.encode_payload(&mut payload).min(payload.len());
        hash.update([telecommand.packet_type()]);
        hash.update((len as u64).to_be_bytes());
        hash.update(&payload[..len]);
    }
    let hash: [u8; 32] = hash.finalize().into();
    hash[..8].iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Approval {
    /// Whether it allows these telecommands now.
    ///
    /// # Errors
    /// Why not, as a sentence.
    pub fn allows(&self, telecommands: &[Telecommand], now: Option<UtcUs>) -> Result<(), String> {
        if self.by.as_str().trim().is_empty() {
            return Err("nobody's name stands in the approval".to_owned());
        }
        if let (Some(now), Some(expires_at)) = (now, self.expires_at)
            && expires_at <= now
        {
            return Err(format!("the approval by {} has expired", self.by));
        }
        match &self.digest {
            Some(given) if *given != digest(telecommands) => Err(format!(
                "{} approved something else ({given}); this is {}",
                self.by,
                digest(telecommands)
            )),
            _ => Ok(()),
        }
    }
}
