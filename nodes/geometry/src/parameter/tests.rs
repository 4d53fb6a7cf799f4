use super::*;

crate::choices! {
    /// Where it comes from.
    #[derive(Default)]
    enum Source {
        /// From a camera.
        Camera = "camera" | "kinect" as default,
        /// From a file
        /// on the disk.
        File = "file",
    }
}

crate::parameters! {
    /// Of the inner struct.
    #[derive(Clone, PartialEq, Debug)]
    struct Inner {
        /// Its edge.
        edge_m: f64 = 0.08, positive;
        /// How many.
        count: u8 = 3, at_least(1.0), read_with("source", "file");
    }
}

crate::parameters! {
    /// Laid among the others.
    #[derive(Clone, PartialEq, Debug)]
    struct Flat {
        /// A share.
        share: f32 = 0.5, share;
    }
}

crate::parameters! {
    /// Of the outer struct.
    #[derive(Clone, PartialEq, Debug)]
    struct Outer {
        /// Where it comes from.
        source: Source;
        /// A group.
        inner: Inner = Inner { count: 9, ..Inner::default() };
        /// What belongs to a file.
        flat: Flat as flatten, changeable, read_with("source", "file");
        /// A mount, over
        /// two lines.
        mount: [f64; 3] = [0.0, 0.5, 1.0];
        /// A name.
        name: String = "map".to_owned();
        /// A switch.
        is_on: bool = true;
        /// No parameter.
        skipped: Flat as skip;
        /// The least of all.
        least: u32 = 2;
    }
    check = Self::check_least;
}

impl Outer {
    fn check_least(&self) -> Result<(), ParameterError> {
        let (least, count) = (f64::from(self.least), f64::from(self.inner.count));
        check("least", ("at most inner.count", count), least, least <= count)
    }
}

#[test]
fn the_bounds_are_as_the_words_say_and_a_nan_is_nowhere() {
    let is = |accepted: Result<(), ParameterError>| accepted.is_ok();
    for (value, expected) in [
        (-1.0, [false, false, false, true]),
        (0.0, [false, true, true, true]),
        (0.5, [true, true, true, true]),
        (1.0, [true, true, false, true]),
        (1.5, [true, true, false, false]),
        (f64::INFINITY, [false, false, false, false]),
        (f64::NAN, [false, false, false, false]),
    ] {
        let found = [
            is(positive("p", value)),
            is(not_negative("p", value)),
            is(below_one("p", value)),
            is(between("p", value, -1.0, 1.0)),
        ];
        assert_eq!(found, expected, "{value}");
    }
    assert!(is(at_least("p", 3, 3)) && !is(at_least("p", 2, 3)));
}

#[test]
fn defaults_are_those_declared() {
    let outer = Outer::default();
    assert_eq!(outer.validate(), Ok(()));
    assert_eq!((outer.inner.edge_m, outer.inner.count, outer.flat.share), (0.08, 9, 0.5));
    assert_eq!((outer.source, outer.name.as_str()), (Source::Camera, "map"));
}

#[test]
fn every_parameter_is_declared_with_its_full_name() {
    let all = all_parameters(Outer::DECLARATIONS);
    let names: Vec<&str> = all.iter().map(|one| one.name.as_str()).collect();
    let expected =
        ["source", "inner.edge_m", "inner.count", "share", "mount", "name", "is_on", "least"];
    assert_eq!(names, expected);
    let of = |name: &str| all.iter().find(|one| one.name == name).unwrap().declaration;
    let texts: Vec<(&str, &str)> =
        of("source").choices().iter().map(|choice| (choice.text, choice.doc)).collect();
    assert_eq!(texts, [("camera", "From a camera."), ("file", "From a file on the disk.")]);
    assert_eq!(of("mount").doc, "A mount, over two lines.");
    assert_eq!((of("inner.edge_m").unit().as_deref(), of("name").unit()), (Some("m"), None));
    let file = Some(Setting { name: "source", value: "file" });
    assert_eq!((of("share").read_with, of("inner.count").read_with), (file, file));
    assert!(of("share").is_changeable && !of("inner.count").is_changeable);
    // What is not declared is what the type has.
    assert_eq!(of("inner.count").range.to_string(), "1 to 255");
    assert_eq!(of("least").range.to_string(), "0 to 4294967295");
}

#[test]
fn each_error_names_the_parameter_what_it_may_be_and_what_it_is() {
    type Spoil = fn(&mut Outer);
    let cases: [(&str, Spoil); 6] = [
        ("parameter inner.edge_m must be above 0, not NaN", |o| o.inner.edge_m = f64::NAN),
        ("parameter inner.count must be 1 to 255, not 0", |o| o.inner.count = 0),
        ("parameter share must be 0 to 1, not 1.5", |o| o.flat.share = 1.5),
        ("parameter mount must be 3 finite numbers, not inf", |o| o.mount[1] = f64::INFINITY),
        ("parameter least must be at most inner.count (9), not 10", |o| o.least = 10),
        // Each by itself comes first.
        ("parameter share must be 0 to 1, not -1", |o| {
            o.flat.share = -1.0;
            o.least = 10;
        }),
    ];
    for (expected, spoil) in cases {
        let mut outer = Outer::default();
        spoil(&mut outer);
        assert_eq!(outer.validate().unwrap_err().to_string(), expected);
    }
}

#[test]
fn a_unit_is_the_end_of_a_name() {
    for (name, unit) in [
        ("evidence_reach_m", Some("m")),
        ("max_turn_rad_per_s", Some("rad/s")),
        ("acceleration_m_per_s2", Some("m/s2")),
        ("gyro_noise_rad_per_sqrt_s", Some("rad/sqrt(s)")),
        ("drift_per_m", Some("1/m")),
        ("least_inliers", None),
        ("m", None),
    ] {
        assert_eq!(Declaration::new::<f64>(name, "").unit().as_deref(), unit, "{name}");
    }
}
