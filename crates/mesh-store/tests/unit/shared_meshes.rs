use std::cell::Cell;

use facemill_surface_model::RepairReport;
use nalgebra::Point3;

use super::*;

/// Strip of so many triangles.
fn strip(n: u32) -> TriMesh {
    let vertices = (0..n + 2).map(|k| Point3::new(f64::from(k / 2), f64::from(k % 2), 0.0)).collect();
    TriMesh::new(vertices, (0..n).map(|k| [k, k + 1, k + 2]).collect()).unwrap()
}

#[test]
fn meshes_are_prepared_once_while_they_are_shared_and_anew_before_and_after() {
    let meshes = SharedMeshes::default();
    let n_made = Cell::new(0);
    let of = |made_from: &str| {
        let mesh = || {
            n_made.set(n_made.get() + 1);
            strip(3)
        };
        (meshes.surface(&made_from, mesh), meshes.obstacle(&made_from, mesh))
    };
    // Nothing is kept, not even what is still there.
    let kept = (of("a"), of("a"));
    assert_eq!(n_made.get(), 4);
    drop(kept);
    let sharing = meshes.share();
    let first = of("a");
    assert_eq!(n_made.get(), 6);
    let again = of("a");
    assert!(Arc::ptr_eq(&first.0, &again.0) && Arc::ptr_eq(&first.1, &again.1));
    let other = of("b");
    assert_eq!(n_made.get(), 8);
    assert!(!Arc::ptr_eq(&first.0, &other.0) && !Arc::ptr_eq(&first.1, &other.1));
    // The last of several ends it.
    let more = meshes.share();
    drop(sharing);
    let _ = (of("a"), of("b"));
    assert_eq!(n_made.get(), 8);
    drop(more);
    let _ = of("a");
    assert_eq!(n_made.get(), 10);
}

#[test]
fn files_are_read_once_and_faults_each_time() {
    let meshes = SharedMeshes::default();
    let _sharing = meshes.share();
    let n_read = Cell::new(0);
    let read = |is_there: bool| {
        n_read.set(n_read.get() + 1);
        let imported = Imported { mesh: strip(2), report: RepairReport::default() };
        if is_there { Ok(imported) } else { Err("not there") }
    };
    assert!(meshes.file(&"part.stl", || read(false)).is_err());
    assert!(meshes.file(&"part.stl", || read(true)).is_ok());
    assert!(meshes.file(&"part.stl", || read(false)).is_ok());
    assert_eq!(n_read.get(), 2);
}

#[test]
fn what_no_setup_has_is_held_up_to_a_number_of_triangles() {
    let mut kept = Kept::<usize>::default();
    let put = |kept: &mut Kept<usize>, name: &str, n: usize| {
        let value = Arc::new(n);
        kept.put(name.to_owned(), &value, |n| *n, 100);
        value
    };
    // In use, so it is known as long as that.
    let first = put(&mut kept, "first", 60);
    drop(put(&mut kept, "second", 40));
    drop(put(&mut kept, "third", 60));
    let is_known = |kept: &Kept<usize>, name: &str| kept.made.iter().any(|made| made.made_from == name);
    assert!(["first", "second", "third"].into_iter().all(|name| is_known(&kept, name)));
    assert!(kept.made[0].held.is_none() && kept.made[1].held.is_some());
    assert!(kept.take("first").is_some_and(|found| Arc::ptr_eq(&found, &first)));
    // The one that was used last comes last, and what is used before it goes first.
    let second = kept.take("second").unwrap();
    kept.put("second".to_owned(), &second, |n| *n, 100);
    drop((first, second));
    drop(put(&mut kept, "fourth", 50));
    assert!(is_known(&kept, "second") && !is_known(&kept, "third"));
    assert!(kept.take("third").is_none() && kept.take("first").is_none());
    // One that is too large alone is not held.
    drop(put(&mut kept, "fifth", 101));
    assert!(kept.take("fifth").is_none() && kept.made.is_empty());
}
