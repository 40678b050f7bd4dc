//! What a report tells of the links of a plan.
