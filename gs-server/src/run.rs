//! The server as a function: it takes its configuration, its listener and its stop from outside, and returns.
//!
//! [`run`] is what `serve` calls; [`run_with`] takes in addition a clock, a store, randomness and wires of the caller's
//! own, as `demo` and tests do. Neither exits the process, sets a global logger or installs a signal handler.
//!
//! Order at start: configuration, keys, archive (lock, check, snapshot, reserve), engine, links, API; then it is ready.
//! Order at the end, 5 s in all: the API takes nothing new and the engine radiates nothing new, links finish the frame
//! that is on the air and the antenna parks, everything that came in becomes durable, the archive is closed.

mod archive;
mod error;
mod options;

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use futures_util::FutureExt as _;
use mission::{Intent, LinkId, Principal};
use protocol::Key;
use tokio::net::TcpListener;
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;

use crate::alerts::{AlertsParts, AlertsTask, Watched};
use crate::clock::{SystemClock, Timer};
use crate::config::{Changes, Config, TwoPerson, station_config};
use crate::elements::task::ElementsTask;
use crate::elements::{Door, ElementsHandle, Fetcher, Wanted};
use crate::engine::{Engine, EngineHandle, EngineParts, LinkPort, OsEntropy};
use crate::forward::{self, ForwardParts};
use crate::hamlib::{self, AntennaTask};
use crate::http::{self, AllowedHosts, HttpState, Identity, RadioOnAir, Tls, TlsFiles, Token};
use crate::hub::Hub;
use crate::ingest::{Aliases, Ears};
use crate::keys;
use crate::leases::Leases;
use crate::lifecycle::Lifecycle;
use crate::links::{self, LinkParts};
use crate::ops::{sd, upkeep::UpkeepTask};
use crate::others::Follower;
use crate::people::{People, PeopleSettings, SessionRules};
use crate::pointing::{Place, Steering};
use crate::report::ReportTask;
use crate::storage::{Store, StoreError};
use crate::ways::{self, WaysParts};

use archive::images_elsewhere;
pub(crate) use archive::{clock_for, newest_event, not_yet_stored, open_store, postgres, snapshot};
pub use error::RunError;
pub use options::{Ready, Report, RunOptions, SetLogFilter};

/// What requests under way may take at the end.
const API_END: Duration = Duration::from_millis(600);
/// What links may take: a frame on the air is sent to its end.
const LINKS_END: Duration = Duration::from_millis(2_800);
/// What the last records may take to become durable.
const ENGINE_END: Duration = Duration::from_millis(900);
/// What closing the archive may take.
const STORE_END: Duration = Duration::from_millis(400);

/// Runs a server until `stop`.
///
/// # Errors
/// [`RunError`] when it cannot begin, or when a part of it died.
pub async fn run(config: Config, listener: TcpListener, stop: CancellationToken) -> Result<Report, RunError> {
    run_with(RunOptions::new(config), listener, stop).await
}

/// [`run`], with what the caller brings along.
///
/// # Errors
/// As [`run`].
pub async fn run_with(
    options: RunOptions,
    listener: TcpListener,
    stop: CancellationToken,
) -> Result<Report, RunError> {
    let RunOptions {
        config,
        timer,
        store,
        entropy,
        mut wires,
        ready,
        reload,
        set_log_filter,
        demo,
        config_file,
    } = options;
    // Whoever brings a clock looks after the machine as well, or need not.
    let looks_after_itself = timer.is_none();
    config.check()?;
    no_core_dumps();
    open_files_for_all();
    tracing::info!("configuration:\n{config}");
    let keys = load_keys(&config)?;
    let station = station_config(&config, &keys)?;
    drop(keys);
    if timer.as_ref().is_some_and(|timer| timer.is_simulated()) && !config.is_simulated() {
        return Err(RunError::ClockKind);
    }
    // A stepped clock stands still until all actors run.
    let starting = timer.as_ref().map(|timer| timer.busy("start of the server"));
    let store = open_store(&config, &station.station, store).await?;
    let timer = match timer {
        Some(timer) => timer,
        None => clock_for(&config, newest_event(&store).await?),
    };
    let address = listener
        .local_addr()
        .map_err(|source| RunError::Io { what: "the listener has no address", source })?;
    let secure = secure(&config, &timer).await?;
    // After the archive: the token file may lie in its folder, which is made with it.
    let token = Token::load_or_create(&config.token_file())?;
    let people = people(&config, &store, &timer, address).await?;
    let snapshot = snapshot(&store, &station).await?;
    let kept = store.reserve_read().await?;
    let was_empty = kept.is_empty();
    let recovered = not_yet_stored(&store, kept).await?;
    if recovered.is_empty() && !was_empty {
        store.reserve_clear().await?;
    }
    if !recovered.is_empty() {
        tracing::warn!(frames = recovered.len(), "{} raw frames come back from the reserve", recovered.len());
    }
    // First the place: what is told after it comes live.
    let told = store.last_event_seq().await?;
    let elsewhere = images_elsewhere(&store, &station).await?;
    if !elsewhere.is_empty() {
        tracing::info!(frames = elsewhere.len(), "other stations heard {} frames of images", elsewhere.len());
    }
    let entropy = match entropy {
        Some(entropy) => entropy,
        None => Box::new(OsEntropy::new().map_err(|source| RunError::Io { what: "no randomness", source })?),
    };
    let hub = Hub::new();
    let (ports, commands): (Vec<_>, Vec<_>) =
        station.links.iter().map(|link| LinkPort::new(link.id.clone())).unzip();
    let identity = Identity::of(&station, config.is_simulated());
    let (antenna, antenna_tasks) = hamlib::antenna(config.rotator.as_ref(), config.rig.as_ref(), &timer)?;
    let name = station.station.clone();
    let (place, radios_on_air) = (Place::of(&station), RadioOnAir::of(&station, &config));
    let ids: Vec<LinkId> = station.links.iter().map(|link| link.id.clone()).collect();
    let watched = Watched::of(&station);
    let (engine, inbox, handle) = Engine::new(EngineParts {
        station,
        snapshot,
        recovered,
        elsewhere,
        store: store.clone(),
        timer: Arc::clone(&timer),
        clock: config.station.clock,
        entropy,
        hub: hub.clone(),
        links: ports,
    });

    let api = Lifecycle::new(&stop);
    // The engine and the links are told to stop with the API, and to end after it.
    let works = Lifecycle::new(&CancellationToken::new());
    let radios = Lifecycle::new(&api.soft);
    let (quiet, finish) = (api.soft.clone(), works.soft.clone());
    works.spawn("engine", async move { engine.run(quiet, finish).await.map_err(Into::into) });
    for ((id, section), commands) in ids.into_iter().zip(&config.links).zip(commands) {
        let wire = wires.remove(&id);
        let (engine, timer, stop) = (inbox.clone(), Arc::clone(&timer), radios.soft.clone());
        let parts = LinkParts { section: section.clone(), engine, commands, timer, wire, id };
        radios.spawn(format!("link {}", section.name), async move {
            links::run(parts, stop).await;
            Ok(())
        });
    }
    if !antenna_tasks.is_empty() {
        let steering =
            Steering::new(place, config.rotator.as_ref(), handle.clone(), inbox.clone(), antenna.clone());
        point(&radios, steering, antenna_tasks);
    }
    if store.is_shared() {
        let speed = config.simulation.map_or(1.0, |simulation| simulation.speed);
        let leases = Leases {
            store: store.clone(),
            engine: handle.clone(),
            inbox: inbox.clone(),
            timer: Arc::clone(&timer),
            speed,
        };
        let stop = api.soft.clone();
        api.spawn("leases", async move {
            leases.run(stop).await;
            Ok(())
        });
        let follower = Follower { store: store.clone(), own: name, hub: hub.clone(), engine: inbox.clone() };
        let others = follower.follow(told, api.soft.clone());
        api.spawn("other stations", async move {
            others.await;
            Ok(())
        });
    }
    let elements = elements(&config, &handle, &store, &timer, &api)?;
    if looks_after_itself {
        let metrics = handle.metrics().clone();
        let upkeep = UpkeepTask::new(&config, config_file, store.clone(), inbox.clone(), metrics);
        let stop = api.soft.clone();
        api.spawn("upkeep", async move {
            upkeep.run(stop).await;
            Ok(())
        });
        sd::tell_systemd(&api, &handle);
    }
    let (alerts_task, alerts) = AlertsTask::new(AlertsParts {
        config: &config,
        watched,
        store: store.clone(),
        engine: handle.clone(),
        hub: hub.clone(),
        timer: Arc::clone(&timer),
    })?;
    alerts_task.spawn(&api);
    reports(&config, &identity, &store, &timer, &hub, &api);
    let forwards = forward::spawn(
        &ForwardParts { config: &config, store: &store, timer: &timer, alerts: Some(&alerts) },
        &api,
    );
    let ears = Ears::new(store.clone(), inbox.clone(), Arc::clone(&timer));
    let aliases = Aliases::of(&config);
    let parts = WaysParts {
        config: &config,
        ears: ears.clone(),
        aliases: aliases.clone(),
        store: store.clone(),
        timer: Arc::clone(&timer),
        tell: {
            let alerts = alerts.clone();
            Arc::new(move |who, found| alerts.report(who, found))
        },
    };
    let ways = ways::open(parts, &api).await?;
    let state = HttpState {
        ears,
        ways,
        aliases,
        elements,
        alerts,
        forwards,
        store: store.clone(),
        engine: handle.clone(),
        hub: hub.clone(),
        antenna,
        radios: radios_on_air,
        timer: Arc::clone(&timer),
        token,
        people: people.clone(),
        identity,
        demo,
        streams_max: config.http.streams,
        stop: api.soft.clone(),
    };
    let mut hosts = AllowedHosts::new(address, &config.http.allowed_hosts);
    if let Some((_, tls)) = &secure {
        hosts = hosts.and(AllowedHosts::new(*tls, &config.http.allowed_hosts));
    }
    let router = http::router(state, hosts);
    let secure_address = secure.as_ref().map(|(_, address)| *address);
    let serving = api.soft.clone();
    if let Some(((listener, tls), address)) = secure {
        let (router, stop) = (router.clone(), api.soft.clone());
        api.spawn("API over TLS", async move {
            http::serve_tls(listener, tls, router, stop).await.map_err(Into::into)
        });
        tracing::info!(%address, "browsers come over https://{address}/");
    }
    api.spawn("API", async move { http::serve(listener, router, serving).await.map_err(Into::into) });
    if let Some(reload) = reload {
        let (engine, soft) = (handle.clone(), api.soft.clone());
        api.spawn("reload", async move {
            reloads(config, reload, engine, set_log_filter, soft).await;
            Ok(())
        });
    }
    tracing::info!(%address, "ready: the API and the page are at http://{address}/");
    if let Some(ready) = ready {
        let is = Ready {
            address,
            secure: secure_address,
            engine: handle.clone(),
            inbox: inbox.clone(),
            hub,
            store: store.clone(),
            timer: Arc::clone(&timer),
            people,
        };
        // Nobody has to wait for it.
        let _ = ready.send(is);
    }
    drop(starting);

    tokio::select! {
        () = api.soft.cancelled() => {}
        () = radios.soft.cancelled() => {}
        () = works.soft.cancelled() => {}
    }
    tracing::info!("stopping");
    api.soft.cancel();
    let (api_left, radios_left) = tokio::join!(api.finish(API_END), radios.finish(LINKS_END));
    works.soft.cancel();
    let abandoned_tasks = api_left + radios_left + works.finish(ENGINE_END).await;
    match crate::clock::within(STORE_END, async move { store.close().await }.boxed()).await {
        Some(Ok(())) => {}
        Some(Err(error)) => tracing::warn!(%error, "the archive was not closed in order: {error}"),
        None => tracing::warn!("the archive was not closed in time; what was told is durable all the same"),
    }
    for life in [&works, &radios, &api] {
        if let Some(failure) = life.failure() {
            return Err(failure.into());
        }
    }
    tracing::info!("stopped");
    Ok(Report { abandoned_tasks })
}

/// A listener with TLS, and its address, where the configuration wants one.
async fn secure(
    config: &Config,
    timer: &Arc<dyn Timer>,
) -> Result<Option<((TcpListener, Tls), SocketAddr)>, RunError> {
    let Some(section) = &config.http.tls else { return Ok(None) };
    let files = TlsFiles { certificate: section.certificate.clone(), key: section.key.clone() };
    let tls = Tls::new(files, Arc::clone(timer) as _)?;
    let failed = |source| RunError::Io { what: "the address in http.tls.listen cannot be used", source };
    let listener = TcpListener::bind(section.listen).await.map_err(failed)?;
    let address = listener.local_addr().map_err(failed)?;
    Ok(Some(((listener, tls), address)))
}

/// Who may come in. Sessions and links run on this machine's clock, however fast the station's own goes.
async fn people(
    config: &Config,
    store: &Store,
    timer: &Arc<dyn Timer>,
    address: SocketAddr,
) -> Result<People, StoreError> {
    let settings = PeopleSettings {
        two_person: config.people.two_person == TwoPerson::Critical,
        approval_us: (config.people.approval_h * 3.6e9) as i64,
        session: SessionRules {
            idle_us: (config.people.session_idle_min * 6e7) as i64,
            max_us: (config.people.session_max_h * 3.6e9) as i64,
        },
        https: config.http.https || config.http.tls.is_some(),
        open_reading: config.http.open_reading,
        on_loopback: address.ip().to_canonical().is_loopback()
            && config.http.tls.as_ref().is_none_or(|tls| tls.listen.ip().to_canonical().is_loopback()),
        station: config.station.name.clone(),
        call_sign: config.station.call_sign.clone(),
        licence: config.station.licence_text.clone(),
    };
    let station_clock = Arc::clone(timer);
    People::open(store.clone(), settings, Arc::new(SystemClock::new()), station_clock).await
}

/// Keys are in memory: no crash may write them to a disk.
fn no_core_dumps() {
    use rustix::process::{Resource, Rlimit, setrlimit};
    let none = Rlimit { current: Some(0), maximum: Some(0) };
    if let Err(error) = setrlimit(Resource::Core, none) {
        tracing::warn!(%error, "core dumps cannot be switched off: {error}");
    }
}

/// Each stream takes an open file, and many systems begin with 1024: as many as the system allows.
fn open_files_for_all() {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let Rlimit { maximum, .. } = getrlimit(Resource::Nofile);
    if let Err(error) = setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum }) {
        tracing::warn!(%error, "the number of open files cannot be raised: {error}");
    }
}

/// The key of each satellite that has one. Simulated keys go with simulated links only, real ones with real links, and
/// no two satellites share one.
pub(crate) fn load_keys(config: &Config) -> Result<BTreeMap<String, Key>, RunError> {
    let mut loaded = BTreeMap::new();
    let mut owners = BTreeMap::new();
    for satellite in &config.satellites {
        let Some(path) = &satellite.key_file else { continue };
        let file = keys::load(path)?;
        if file.simulated != config.is_simulated() {
            return Err(RunError::KeyKind { file: path.display().to_string(), simulated: file.simulated });
        }
        if let Some(first) = owners.insert(file.id().to_string(), satellite.name.clone()) {
            return Err(RunError::KeyShared { first, second: satellite.name.clone(), key: file.id() });
        }
        loaded.insert(satellite.name.clone(), file.key);
    }
    Ok(loaded)
}

/// Elements from the sources of the configuration: a task of its own, where there are any.
fn elements(
    config: &Config,
    engine: &EngineHandle,
    store: &Store,
    timer: &Arc<dyn Timer>,
    api: &Lifecycle,
) -> Result<ElementsHandle, RunError> {
    let (wanted, timer) = (Wanted::of(config), Arc::clone(timer));
    if config.elements.fetch.is_empty() {
        return Ok(ElementsHandle::without_sources(wanted, timer));
    }
    let door = Door { engine: engine.clone(), store: store.clone() };
    let fetcher = Fetcher::new(config, store.folder(), door, Arc::clone(&timer)).map_err(|source| {
        RunError::Io { what: "the folder 'elements' in the data folder cannot be made", source }
    })?;
    let (task, handle) = ElementsTask::new(fetcher, wanted, timer);
    let stop = api.soft.clone();
    api.spawn("elements", async move {
        task.run(stop).await;
        Ok(())
    });
    Ok(handle)
}

/// The report of each pass as a file, unless nobody wants them.
fn reports(
    config: &Config,
    identity: &Identity,
    store: &Store,
    timer: &Arc<dyn Timer>,
    hub: &Hub,
    api: &Lifecycle,
) {
    if !config.reports.passes {
        return;
    }
    let task = ReportTask {
        store: store.clone(),
        identity: identity.clone(),
        timer: Arc::clone(timer),
        hub: hub.clone(),
        folder: config.reports.folder.clone().unwrap_or_else(|| store.folder().join("reports")),
    };
    let stop = api.soft.clone();
    api.spawn("reports", async move {
        task.run(stop).await;
        Ok(())
    });
}

/// Rotator and rig, and who steers them. They live and die with the links: whatever ends the server parks the antenna.
fn point(radios: &Lifecycle, steering: Steering, tasks: Vec<AntennaTask>) {
    for task in tasks {
        let stop = radios.soft.clone();
        radios.spawn(task.name(), async move {
            task.run(stop).await;
            Ok(())
        });
    }
    let stop = radios.soft.clone();
    radios.spawn("steering", async move {
        steering.run(stop).await;
        Ok(())
    });
}

/// Applies what can be applied of changed configurations, and names what needs a restart.
async fn reloads(
    mut config: Config,
    mut reload: mpsc::Receiver<Config>,
    engine: EngineHandle,
    set_log_filter: Option<SetLogFilter>,
    stop: CancellationToken,
) {
    let mut number = 0_u64;
    loop {
        let new = tokio::select! {
            () = stop.cancelled() => return,
            new = reload.recv() => match new {
                Some(new) => new,
                None => return stop.cancelled().await,
            },
        };
        if let Err(error) = new.check() {
            tracing::error!(%error, "the changed configuration is refused, the old one stays in force: {error}");
            continue;
        }
        let changes = Changes::between(&config, &new);
        if changes.is_empty() {
            tracing::info!("reload: nothing has changed");
        }
        if let (Some(filter), Some(set)) = (&changes.log_filter, &set_log_filter) {
            set(filter);
            tracing::info!(%filter, "reload: log filter is '{filter}' now");
        }
        for (name, armed) in &changes.armed {
            number += 1;
            let Ok(link) = LinkId::new(name) else { continue };
            let key = format!("reload-{}-{number}", uuid::Uuid::new_v4());
            let intent = Intent::ArmLink { link, armed: *armed };
            match engine.intent(Principal::new("configuration"), key, [0; 32], intent).await {
                Ok(_) => {
                    tracing::info!(link = %name, armed, "reload: link {name} is {}", if *armed { "armed" } else { "not armed any more" })
                }
                Err(error) => {
                    tracing::error!(link = %name, "reload: link {name} cannot be armed or disarmed: {error}")
                }
            }
        }
        for key in &changes.need_restart {
            tracing::warn!(%key, "reload: {key} has changed and needs a restart; the old value stays in force");
        }
        // What was applied is in force; the rest is named again at the next reload.
        for (name, armed) in changes.armed {
            if let Some(link) = config.links.iter_mut().find(|link| link.name == name) {
                link.armed = armed;
            }
        }
        config.log.filter = new.log.filter;
    }
}
