//! Tests of the storage as a whole; each has a folder of its own.
