//! Laws of levels: room, reach, pieces and contours against closed forms.

mod pins;
mod posts;
