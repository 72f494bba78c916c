//! gs-server
