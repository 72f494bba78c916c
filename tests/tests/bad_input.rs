//! Bad input, each against the real `gs-server` process.
