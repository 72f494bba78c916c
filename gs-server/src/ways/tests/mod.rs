//! Whole servers with real brokers, real clients and stand-ins on real sockets.

mod bench;
mod broker;
mod doors;
mod mosquitto;
mod orders;
mod pollers;
mod tls;
