//! Laws that hold without a job: of verdicts, searches and plans, against closed forms and brute
//! force.

mod across_rooms;
mod circles;
mod closed_forms;
mod cusps_of_fronts;
mod doors;
mod efficiency;
mod formats_page;
mod key_ranges;
mod names;
mod public_items;
mod rooms;
mod sample_pages;
mod verdicts;
