//! A window without a screen, on a real server with a simulated satellite: what the tests of the window share.
//!
//! ```ignore
//! let mut seat = Seat::take();                         // server, satellite, window; connected
//! seat.layout(Layout::Plan);
//! seat.click("Arm");                                   // by accessible label
//! seat.until("armed", |seat| seat.has("armed"));       // draws frames until it is so, or tells what is on the screen
//! seat.picture("plan");                                // target/tmp/pictures/plan.png, to look at
//! ```

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Duration;

use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use ground_app::App;
use ground_app::desk::{Desk, Layout};
use ground_app::embedded::{Embedded, EmbeddedOptions};
use ground_app::link::{Link, Server, Wake};
use ground_app::model::Model;

/// Nothing that a test waits for takes longer, on a busy machine.
pub(crate) const PATIENCE: Duration = Duration::from_secs(30);
/// A frame of the window, seconds of its own time; also how long one is waited for in vain.
const FRAME_S: f32 = 0.05;

/// How a seat is to be.
pub(crate) struct SeatOptions {
    /// Points.
    pub(crate) size: [f32; 2],
    /// Simulated seconds per second; `None`: as fast as the machine can.
    pub(crate) speed: Option<f64>,
    /// Whether the server inside sends by itself what an operator would.
    pub(crate) operates: bool,
    /// The arrangement to begin with.
    pub(crate) desk: Desk,
    /// Draw with a renderer, for [`Seat::picture`]; without, only labels are there and frames are cheaper.
    pub(crate) draws: bool,
}

impl Default for SeatOptions {
    fn default() -> Self {
        Self { size: [1280.0, 800.0], speed: Some(5.0), operates: false, desk: Desk::default(), draws: false }
    }
}

/// An operator's seat: the window, and perhaps the server inside.
pub(crate) struct Seat {
    /// The window.
    pub(crate) harness: Harness<'static, App>,
    /// Server and satellite; `None` for a seat on another server, or after [`Seat::stop_server`].
    pub(crate) embedded: Option<Embedded>,
    woken: Receiver<()>,
    folder: Option<tempfile::TempDir>,
}

impl Seat {
    /// On a server of its own with a satellite that nobody commands but you; connected.
    pub(crate) fn take() -> Self {
        Self::take_with(SeatOptions::default())
    }

    /// The same, otherwise.
    pub(crate) fn take_with(options: SeatOptions) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let data = Some(folder.path().join("data"));
        let embedded =
            Embedded::start(EmbeddedOptions { data, speed: options.speed, operates: options.operates })
                .unwrap();
        let server = embedded.server().clone();
        let mut seat = Self::at(&server, options);
        seat.embedded = Some(embedded);
        seat.folder = Some(folder);
        seat.until("connected, and the first questions are answered", |seat| {
            let model = seat.model();
            model.connection.is_live() && model.status.is_some() && model.receivers.revision() > 0
        });
        seat
    }

    /// On some server, connected or not.
    pub(crate) fn at(server: &Server, options: SeatOptions) -> Self {
        let (tell, woken) = sync_channel(1);
        let wake: Wake = Arc::new(move || {
            let _ = tell.try_send(());
        });
        let link = Link::open(server, wake).unwrap();
        let app = App::new(link, options.desk, None);
        let builder = Harness::builder()
            .with_size(options.size)
            .with_step_dt(FRAME_S)
            .with_max_steps(40)
            .with_context_setup(|context| ui::install(context, ui::Mode::Dark));
        let builder = if options.draws { builder.wgpu() } else { builder };
        let harness = builder.build_eframe(|_| app);
        Self { harness, embedded: None, woken, folder: None }
    }

    /// What is known, to look at. Let go of it before the next frame.
    pub(crate) fn model(&self) -> std::sync::MutexGuard<'_, Model> {
        self.harness.state().link().model()
    }

    /// Draws frames until it is so. Panics with what is on the screen when it never is.
    #[track_caller]
    pub(crate) fn until(&mut self, what: &str, mut holds: impl FnMut(&mut Self) -> bool) {
        let begun = ground_app::clock::instant();
        loop {
            self.harness.step();
            if holds(self) {
                return;
            }
            let waited = ground_app::clock::instant().duration_since(begun);
            if waited >= PATIENCE {
                let connection = self.model().connection.clone();
                let failures = self.failures();
                panic!(
                    "never so: {what}; the line: {connection:?}; unanswered: {failures:?}; on the screen: {:#?}",
                    self.labels()
                );
            }
            let _ = self.woken.recv_timeout(Duration::from_secs_f32(FRAME_S));
        }
    }

    /// Which questions were refused, and why.
    pub(crate) fn failures(&self) -> Vec<String> {
        let model = self.model();
        macro_rules! failures {
            ($($field:ident)*) => {
                [$((stringify!($field), model.$field.failure())),*]
            };
        }
        let all = failures!(
            version session passes schedule plans runs rehearsals alerts approvals limits latest parameters
            commands downloads images frames events elements receivers
        );
        all.into_iter().filter_map(|(name, why)| Some(format!("{name}: {}", why?))).collect()
    }

    /// Whether something on the screen has this accessible label, wholly.
    pub(crate) fn has(&self, label: &str) -> bool {
        self.harness.query_all_by_label(label).next().is_some()
    }

    /// Whether something on the screen has a label or a value with this in it.
    pub(crate) fn shows(&self, part: &str) -> bool {
        let labelled = self.harness.query_all_by_label_contains(part).next().is_some();
        labelled || self.labels().iter().any(|label| label.contains(part))
    }

    /// All that is on the screen, as a screen reader would have it.
    pub(crate) fn labels(&self) -> Vec<String> {
        let mut all = Vec::new();
        for node in self.harness.root().children_recursive() {
            let seen = node.accesskit_node();
            all.extend(seen.label());
            all.extend(seen.value());
        }
        all.retain(|text| !text.is_empty());
        all
    }

    /// Clicks what has this label (the first of several) and draws some frames.
    #[track_caller]
    pub(crate) fn click(&mut self, label: &str) {
        let found = self.harness.query_all_by_label(label).next();
        let Some(node) = found else { panic!("no '{label}' on the screen: {:#?}", self.labels()) };
        node.click();
        self.harness.run_steps(3);
    }

    /// Presses a key and draws some frames.
    pub(crate) fn press(&mut self, key: egui::Key) {
        self.press_with(egui::Modifiers::NONE, key);
    }

    /// Presses a key together with others.
    pub(crate) fn press_with(&mut self, modifiers: egui::Modifiers, key: egui::Key) {
        self.harness.key_press_modifiers(modifiers, key);
        self.harness.run_steps(3);
    }

    /// Types into what has this label.
    #[track_caller]
    pub(crate) fn type_into(&mut self, label: &str, text: &str) {
        let found = self.harness.query_all_by_label(label).next();
        let Some(node) = found else { panic!("no '{label}' on the screen: {:#?}", self.labels()) };
        node.focus();
        self.harness.run_steps(2);
        self.harness.get_all_by_label(label).next().unwrap().type_text(text);
        self.harness.run_steps(3);
    }

    /// Shows a layout by its key.
    pub(crate) fn layout(&mut self, layout: Layout) {
        let keys = [
            egui::Key::Num1,
            egui::Key::Num2,
            egui::Key::Num3,
            egui::Key::Num4,
            egui::Key::Num5,
            egui::Key::Num6,
        ];
        self.press(keys[layout as usize]);
        assert_eq!(self.harness.state().desk().layout, layout);
    }

    /// The satellite is in view, and was heard in this pass.
    pub(crate) fn until_in_pass(&mut self) {
        self.until("in a pass", |seat| {
            let model = seat.model();
            model.status.as_ref().is_some_and(|(status, _)| {
                let heard = |satellite: &api::SatelliteView| satellite.heard_at.is_some();
                status.satellites.iter().any(|one| one.in_view == Some(true) && heard(one))
            })
        });
    }

    /// Draws what is on the screen into `target/tmp/pictures/NAME.png`. Needs `draws: true`.
    pub(crate) fn picture(&mut self, name: &str) -> image::RgbaImage {
        self.harness.remove_cursor();
        self.harness.run_steps(2);
        let picture = self.harness.render().unwrap();
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("pictures");
        std::fs::create_dir_all(&folder).unwrap();
        picture.save(folder.join(format!("{name}.png"))).unwrap();
        picture
    }

    /// The server inside ends, in the middle of whatever it does.
    pub(crate) fn stop_server(&mut self) {
        self.embedded = None;
    }
}
