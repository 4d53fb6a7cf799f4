use geometry::RigMounts;
use nalgebra::Isometry3;

use super::super::tf_bag;
use super::*;

/// Regression: with poses by tf the mounts were those of tf whatever the user said, where that was the default, and also where tf had none.
#[test]
fn mounts_are_those_of_tf_where_it_has_them_and_no_parameter_says_otherwise() {
    let folder = tempfile::tempdir().unwrap();
    let states = folder.path().join("states.yaml");
    std::fs::write(&states, "/**:\n  ros__parameters:\n    extrinsics: parameters\n").unwrap();
    let bag = folder.path().join("robot.mcap");
    for (on_robot, files, extrinsics, note) in [
        (&["camera", "laser"][..], vec![], ExtrinsicsSource::TfFromRig, "by tf, too"),
        (
            &["camera", "laser"],
            vec![states.clone()],
            ExtrinsicsSource::Parameters,
            "those of the parameters",
        ),
        (
            &["camera"],
            vec![],
            ExtrinsicsSource::Parameters,
            "since tf does not connect base_link with laser",
        ),
    ] {
        let place = Isometry3::translation(0.1, 0.2, 0.3);
        let on_robot: Vec<_> = on_robot.iter().map(|frame| (*frame, place)).collect();
        tf_bag::write(&bag, &on_robot);
        let opened = Bag::open(&bag).unwrap();
        let args = ParameterArgs { files, ..ParameterArgs::default() };
        let mut parameters = PipelineParameters::load(&args).unwrap();
        let mut topics = TopicArgs::default();
        topics.pose = Some("tf".to_owned());
        let info = opened.info().unwrap();
        let (inputs, said) = choose_inputs(&opened, &info, &topics, &mut parameters).unwrap();
        assert_eq!(inputs.pose, PoseSource::Tf);
        let said = said.unwrap_or_default();
        assert!(said.contains(note), "{on_robot:?}: {said}");
        let rig = &parameters.pipeline().rig;
        assert_eq!((rig.extrinsics, rig.rig_frame_id.as_str()), (extrinsics, "base_link"));
        assert_eq!(rig.mounts(), RigMounts::default());
    }
}

/// Regression: with `--no-colour` the topic that `--image` names was not even looked for.
#[test]
fn a_topic_of_colours_is_refused_where_none_are_wanted() {
    #[derive(clap::Parser)]
    struct Run {
        #[command(flatten)]
        topics: TopicArgs,
    }
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("robot.mcap");
    tf_bag::write(&bag, &[("camera", Isometry3::identity()), ("laser", Isometry3::identity())]);
    let run = <Run as clap::Parser>::parse_from(["run", "--image", "/nope"]);
    let parameters = ParameterArgs::default();
    let chosen = Chosen::of(&bag, &run.topics, (&parameters, true), &Interrupt::default());
    let Err(refusal) = chosen else { panic!("it is not refused") };
    assert!(refusal.to_string().contains("no effect with --no-colour"), "{refusal}");
}
