//! Test kit of the workspace: slow, independent code that defines what is correct.
