//! The twin behind its module on a pseudo-terminal, the real serial link, the real store, on stepped time: the driver
//! configures the module, heartbeats come down, a telecommand goes up and is answered, all in simulated minutes.

use std::io::{Read as _, Write as _};
use std::sync::Arc;
use std::time::Duration;

use crate::support::{Folder, Pty, Server, ping, until, wall};
use gs_server::clock::{BusyToken, SteppedClock, SteppedOptions, Timer, Wire};
use gs_server::engine::SeededEntropy;
use gs_server::run::RunOptions;
use mission::{Accepted, Clock as _, LinkId, LinkState, MonoUs, Principal, UtcUs};
use protocol::Key;
use radio::airtime::LoraPhy;
use radio::model::{ModelConfig, Ufreq};
use radio::registers::Registers;
use satellite::{ChannelConfig, Device, DeviceConfig, DeviceOutput, TwinConfig};
use tokio::sync::mpsc;

/// The far end as an actor on the stepped clock.
async fn far_end(
    mut device: Device,
    timer: Arc<dyn Timer>,
    wire: Wire,
    mut written: mpsc::Receiver<(Vec<u8>, BusyToken)>,
    mut port: serialport::TTYPort,
    mut awake: BusyToken,
) {
    let mut heard: Option<Vec<u8>> = None;
    loop {
        let now = timer.now().mono.0;
        let mut carry_out = |device: &mut Device| {
            while let Some(output) = device.poll(now) {
                if let DeviceOutput::HostBytes(bytes) = output {
                    wire.to_host.wrote(bytes.len());
                    port.write_all(&bytes).unwrap();
                }
            }
        };
        carry_out(&mut device);
        if let Some(bytes) = heard.take() {
            device.host_write(now, &bytes);
            carry_out(&mut device);
        }
        let sleep = timer.sleep_until(MonoUs(device.next_event_us().unwrap_or(u64::MAX)));
        drop(awake);
        awake = tokio::select! {
            token = sleep => token,
            piece = written.recv() => match piece {
                Some((bytes, token)) => {
                    heard = Some(bytes);
                    token
                }
                None => return,
            },
        };
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_twin_on_a_pseudo_terminal_is_heard_and_commanded_on_stepped_time() {
    let folder = Folder::new();
    let clock =
        SteppedClock::new(SteppedOptions { utc_at_origin: UtcUs(1_805_544_000_000_000), speed: None })
            .unwrap();
    let timer: Arc<dyn Timer> = Arc::new(clock.clone());
    let starting = timer.busy("test");
    let wire = Wire::new(&timer);

    let pty = Pty::at(&folder.port());
    let mut reading = pty.master.try_clone_native().unwrap();
    let (send, written) = mpsc::channel(64);
    let (gauge, reader_timer) = (wire.from_host.clone(), Arc::clone(&timer));
    std::thread::spawn(move || {
        let mut buffer = [0; 4096];
        loop {
            match reading.read(&mut buffer) {
                Ok(count) => {
                    let token = reader_timer.busy("bytes on their way to the module");
                    gauge.read(count);
                    if send.blocking_send((buffer[..count].to_vec(), token)).is_err() {
                        return;
                    }
                }
                Err(error) if error.kind() == std::io::ErrorKind::TimedOut && !send.is_closed() => {}
                Err(_) => return,
            }
        }
    });
    let twin = TwinConfig::new(7, Key::from_bytes(*b"0123456789abcdef"));
    let model = ModelConfig {
        registers: Registers::FACTORY.with_software_switch(true),
        ufreq: Some(Ufreq { start_hz: 410_000_000, step_hz: 1_000_000, last_channel: 83 }),
        phy: LoraPhy::LIKELY_2K4,
        ..ModelConfig::default()
    };
    let device = Device::new(DeviceConfig::new(twin, ChannelConfig::perfect(), model));
    let far = tokio::spawn(far_end(
        device,
        Arc::clone(&timer),
        wire.clone(),
        written,
        pty.master.try_clone_native().unwrap(),
        starting.clone(),
    ));

    let mut options = RunOptions::new(folder.config("mode_pins = \"software\""));
    options.config.links[0].rssi = Some(true);
    options.timer = Some(Arc::clone(&timer));
    options.entropy = Some(Box::new(SeededEntropy::new(1)));
    options.wires.insert(LinkId::new("pty").unwrap(), wire);
    let began = wall();
    let server = Server::start(options).await.unwrap();
    drop(starting);
    let patience = Duration::from_secs(30);
    let told = || format!("{:?} {:?} {:?}", server.status(), clock.holders(), clock.now());
    until("the link is up", patience, async || server.link() == LinkState::Ok).await;
    until("heard", patience, async || server.status().satellites[0].in_contact).await;
    let done =
        server.ready.engine.intent(Principal::new("test"), "ping".into(), [1; 32], ping()).await.unwrap();
    let Accepted::Command(id) = done.accepted else { panic!("not accepted: {}", told()) };
    until("answered", patience, async || {
        let life = server.ready.store.command(i64::try_from(id.0).unwrap()).await.unwrap().unwrap();
        format!("{life:?}").contains("answered")
    })
    .await;
    let simulated = clock.now().mono.0 / 1_000_000;
    assert!(server.status().links[0].bad == 0, "{}", told());
    assert!(simulated > 3, "the first heartbeat comes after boot, at 5 s: {simulated}");
    assert!(began.elapsed() < Duration::from_secs(simulated), "faster than life");
    let (took, _) = server.stop().await;
    assert!(took < Duration::from_secs(5), "{took:?}");
    far.abort();
}
