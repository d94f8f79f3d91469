//! The steps of `docs/deployment.md`, run as they stand.

use std::{env, fs, os::unix::fs::symlink, process::Command};

use rustix::process::Signal;

use crate::command::{ask_as, has, line, path, printed, serving, signal};
use crate::docs::root;
use crate::markdown::blocks;

#[test]
fn the_steps_of_backup_and_restore_keep_the_tokens() {
    if !has("bash") {
        return;
    }
    let page = fs::read_to_string(root().join("docs/deployment.md")).expect("the page is there");
    let section = page.split("\n## ").find(|section| section.starts_with("Backup and restore"));
    let steps = blocks(section.expect("the page has it"));
    let [backup, restore] = &steps[..] else {
        panic!("one block for each");
    };
    let folder = tempfile::tempdir().expect("there is room");
    let data = path(&folder, "data");
    fs::create_dir(&data).expect("there is room");
    let admin = printed(&line(&format!("token add admin --role admin --data {data}")));
    let admin = Some(admin.trim());
    let serve = || serving(&["--data", &data]);
    let bin = folder.path().join("bin");
    fs::create_dir(&bin).expect("there is room");
    symlink(env!("CARGO_BIN_EXE_pilotfish"), bin.join("pilotfish")).expect("is made");
    let sh = |steps: &str| {
        let steps = steps
            .replace("/var/lib/private/pilotfish", &data)
            .replace("/var/lib/pilotfish", &data)
            .replace("/srv", &folder.path().display().to_string())
            .replace("$(date +%F)", "2026-11-23");
        let paths = format!("{}:{}", bin.display(), env::var("PATH").expect("is set"));
        // The test is not root, and starts the service itself.
        let stubs = "set -e; sudo() { case $1 in systemctl|chown) ;; *) \"$@\";; esac; }\n";
        let mut bash = Command::new("bash");
        bash.args(["-c", &format!("{stubs}{steps}")]).env("PATH", paths);
        printed(&bash.output().expect("bash starts"));
    };

    let mut server = serve();
    let mission =
        r#"{"schema_version":"1.0","live":{"auvs":[{"id":"a"}],"goal":{"kind":"track","auv":"a"}}}"#;
    let created = ask_as(&server, admin, "POST", "/v1/missions", mission);
    let mission = format!("/v1/missions/{}", created.json()["id"].as_str().expect("has a name"));
    sh(&backup.text);
    assert_eq!(ask_as(&server, admin, "DELETE", &mission, "").status, 204);
    signal(&server.process, Signal::TERM);
    assert!(server.process.wait().expect("is ours").success());
    sh(&restore.text);
    let server = serve();
    assert_eq!(ask_as(&server, None, "DELETE", &mission, "").status, 401);
    assert_eq!(ask_as(&server, admin, "GET", &mission, "").status, 200);
}
