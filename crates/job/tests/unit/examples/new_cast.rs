use crate::examples::new_job::{NewJob, new_job};

#[test]
fn a_diameter_that_the_tools_do_not_fit_is_refused() {
    for diameter_mm in [100.0, 5000.0, f64::NAN] {
        let why = new_job(&NewJob::CastPropeller { diameter_mm }).expect_err("refused");
        assert!(why.contains("from 800 to 1200 mm"), "{why}");
    }
}
