//! Room to be built: see `docs/architecture.md`.
