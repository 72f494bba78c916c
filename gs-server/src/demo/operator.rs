//! What an operator would send during a demo, through the door that operators have.

use mission::{CommandIntent, Gate, ImageId, Intent, Now, Principal, SatelliteId, Status};
use protocol::{Resolution, Telecommand};
use sha2::{Digest as _, Sha256};

use super::scene::Scene;
use crate::engine::EngineHandle;

/// From an image that is home to the next picture, in simulated microseconds.
const NEXT_PICTURE_US: u64 = 60_000_000;

pub(super) struct Operator {
    engine: EngineHandle,
    /// Keys of an earlier demo in the same folder are not used again.
    life: String,
    asked: u64,
    greeted: bool,
    until_image: bool,
    /// The image that came home last, and when on the clock's scale.
    home: Option<(ImageId, u64)>,
    /// A new picture was asked for and is not ordered yet.
    captured: bool,
}

impl Operator {
    pub(super) fn new(scene: &Scene, until_image: bool) -> Self {
        Self {
            engine: scene.ready.engine.clone(),
            life: scene.start_us.to_string(),
            asked: 0,
            greeted: false,
            until_image,
            home: None,
            captured: false,
        }
    }

    /// Looks at the station and sends what is due.
    pub(super) async fn act(&mut self, status: &Status, now: Now) {
        let Some(satellite) = status.satellites.first().filter(|satellite| satellite.in_contact) else {
            return;
        };
        if !self.greeted {
            self.greeted = true;
            self.command(Telecommand::Ping).await;
            self.command(Telecommand::GetAdcsInfo).await;
            let utc_ms = (now.utc.0 / 1000).cast_unsigned();
            self.command(Telecommand::SetTimestamp { utc_ms }).await;
            self.order_image().await;
            return;
        }
        if self.until_image || satellite.download.is_some() {
            return;
        }
        if self.captured {
            if satellite.queued == 0 && satellite.outstanding.is_none() {
                self.captured = false;
                self.order_image().await;
            }
            return;
        }
        let Some(image) =
            satellite.image.as_ref().filter(|image| image.chunks > 0 && image.held == image.chunks)
        else {
            return;
        };
        match self.home {
            Some((home, since_us)) if home == image.image => {
                if now.mono.0 >= since_us + NEXT_PICTURE_US && satellite.in_view != Some(false) {
                    self.captured = true;
                    let resolution = Resolution::Cif;
                    let capture =
                        Telecommand::CaptureImage { resolution, grey: false, strong_compression: false };
                    self.command(capture).await;
                }
            }
            _ => self.home = Some((image.image, now.mono.0)),
        }
    }

    async fn order_image(&mut self) {
        if let Ok(satellite) = SatelliteId::new("pixelsat-1") {
            self.ask(Intent::Download { satellite, link: None }).await;
        }
    }

    async fn command(&mut self, telecommand: Telecommand) {
        let Ok(satellite) = SatelliteId::new("pixelsat-1") else { return };
        let confirmation = telecommand.is_critical().then(|| telecommand.name().to_owned());
        let intent = CommandIntent {
            satellite,
            link: None,
            telecommand,
            priority: 0,
            gate: Gate::Heard,
            expires_at: None,
            when: None,
            attempts_allowed: None,
            confirmation,
        };
        self.ask(Intent::Command(intent)).await;
    }

    async fn ask(&mut self, intent: Intent) {
        self.asked += 1;
        let key = format!("demo-{}-{}", self.life, self.asked);
        let digest = Sha256::digest(&key).into();
        if let Err(error) = self.engine.intent(Principal::new("demo"), key, digest, intent).await {
            tracing::warn!("the demo's operator was refused: {error}");
        }
    }
}
