//! MQTT 3.1.1: packets on the wire, and a client.

mod client;
mod connect;
pub(super) mod wire;
pub(super) mod words;

pub(super) use client::Client;
