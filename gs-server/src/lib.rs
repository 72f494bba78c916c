//! The ground station's server: the shell around [`mission::Station`].
//!
//! | module | what it holds |
//! |---|---|
//! | [`run`] | the server as a function; the order of start and end |
//! | [`engine`] | the actor that owns the station and carries out what it asks |
//! | [`links`] | serial ports, TCP connections, recordings: each an actor with the radio driver |
//! | [`elements`] | where elements come from: operators, and sources that are asked politely |
//! | [`hamlib`] | rotator and rig behind hamlib's daemons: clients, and the tasks that follow a satellite |
//! | [`storage`], [`witness`] | the archive, the reserve, and the counters' witness beside them |
//! | [`alerts`] | what is wrong, who knows of it and who is told: e-mail, webhooks, chats |
//! | [`ingest`] | what strangers' stations heard: formats, and the way into the archive |
//! | [`ways`] | ways in over the network for what others heard: MQTT, a broker of our own, TinyGS, SatNOGS |
//! | [`hub`] | committed events on their way to watchers |
//! | [`http`] | API v1, the stream, the first page |
//! | [`clock`] | the machine's clock and simulated ones; the only place that reads time or sets a timer |
//! | [`config`] | one TOML file, a struct per section |
//! | `leases`, `others` | sharing a database with other servers: who may seal, what they heard |
//! | [`lifecycle`] | how tasks live and die |
//! | [`sky`] | elements to passes, looks, plots and calendars |
//! | [`keys`], [`decode`] | key files; captures to JSON |
//! | [`twin`], [`demo`] | the simulated satellite behind a real port; a pass with everything real but the satellite |
//! | [`plan`] | plans as text: read, checked, templates |
//! | [`people`] | who may do what |
//! | `schedule` | a schedule in the words of the API |
//! | `rehearsed` | what a rehearsal came to, in the words of the API |
//! | [`report`] | what a pass brought, what the next shift must know: values, pages, texts |
//! | `pointing` | whom the antenna follows, by the schedule |
//! | [`ops`] | backups, and what else keeps a server running for years |
//! | [`cli`] | the command line, a file per verb |
//!
//! What it does **not** do: decide what to send or when (the mission engine does), know the wire format (`protocol`
//! does) or the module's commands (`radio` does). Tasks and threads are born only here.

pub mod alerts;
pub mod cli;
pub mod clock;
pub mod config;
pub mod decode;
pub mod demo;
pub mod elements;
pub mod engine;
pub mod forward;
pub mod hamlib;
pub mod http;
pub mod hub;
pub mod ingest;
pub mod keys;
mod leases;
pub mod lifecycle;
pub mod links;
pub mod ops;
mod others;
pub mod people;
pub mod plan;
mod pointing;
mod rehearsed;
pub mod report;
pub mod run;
mod schedule;
pub mod sky;
pub mod storage;
pub mod twin;
pub mod ways;
pub mod witness;
