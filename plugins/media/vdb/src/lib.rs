//! Resolvent: vdb.
