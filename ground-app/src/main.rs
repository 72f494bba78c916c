//! The operator's desktop app.

use std::sync::Arc;

use anyhow::Context as _;
use clap::Parser as _;
use ground_app::App;
use ground_app::args::{Args, ThemeWord};
use ground_app::desk::DeskFile;
use ground_app::link::{Link, Server};

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    tracing_subscriber::fmt().with_writer(std::io::stderr).with_env_filter(filter()).init();
    let (mut file, mut desk, told) = DeskFile::open(&args.desk_file())?;
    if let Some(told) = told {
        tracing::warn!("the desk was not readable: {told}");
    }
    if let Some(theme) = args.theme {
        desk.theme = if theme == ThemeWord::Dark { ui::Mode::Dark } else { ui::Mode::Light };
        file.keep(&desk, ground_app::clock::instant(), true);
    }
    let inside = Inside::of(&args)?;
    let server = inside.server.clone();
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("PixelSat Ground")
            .with_app_id("pixelsat-ground")
            .with_inner_size([1280.0, 800.0])
            .with_min_inner_size([800.0, 500.0]),
        persist_window: true,
        ..eframe::NativeOptions::default()
    };
    let begin = move |context: &eframe::CreationContext<'_>| {
        ui::install(&context.egui_ctx, desk.theme);
        let window = context.egui_ctx.clone();
        let link = Link::open(&server, Arc::new(move || window.request_repaint()))?;
        Ok(Box::new(App::new(link, desk, Some(file))) as Box<dyn eframe::App>)
    };
    eframe::run_native("PixelSat Ground", options, Box::new(begin))
        .map_err(|error| anyhow::anyhow!("no window: {error}"))?;
    drop(inside);
    Ok(())
}

fn filter() -> tracing_subscriber::EnvFilter {
    tracing_subscriber::EnvFilter::try_from_default_env().unwrap_or_else(|_| "warn,gs_server=info".into())
}

/// The server, and what of it is inside.
struct Inside {
    server: Server,
    #[cfg(feature = "embedded")]
    _embedded: Option<ground_app::embedded::Embedded>,
}

impl Inside {
    #[cfg(feature = "embedded")]
    fn of(args: &Args) -> anyhow::Result<Self> {
        use ground_app::embedded::{Embedded, EmbeddedOptions};
        if let Some(server) = args.server()? {
            return Ok(Self { server, _embedded: None });
        }
        let options = EmbeddedOptions { data: args.data.clone(), speed: Some(args.speed), operates: true };
        let embedded = Embedded::start(options).context("the server inside")?;
        Ok(Self { server: embedded.server().clone(), _embedded: Some(embedded) })
    }

    #[cfg(not(feature = "embedded"))]
    fn of(args: &Args) -> anyhow::Result<Self> {
        let server = args.server()?.context("this build carries no server: give --url http://HOST:PORT")?;
        Ok(Self { server })
    }
}
