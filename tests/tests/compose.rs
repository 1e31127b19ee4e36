//! The fleet in containers: builds the image, flies `docker-compose.yml`, and looks at what is left of it on the host.
//!
//! Needs a Docker engine and Docker Compose, 1.29 or 2; without them it says so and passes. So that no registry of images
//! is needed, the image is built in a stand-in for the official Rust image that `compose/builder.sh` puts together from
//! this machine's toolchain. Everything else is what users run: the Dockerfile with its last stage from `scratch`, static
//! linking, name resolution by static glibc, the networks, the users, the folder on the host.
//!
//! Not tested: the official images themselves, `RUNTIME=debian:bookworm-slim`, the `release` profile (`dev` takes half the
//! time to build), and that crates can be fetched and compiled inside a container (what they were compiled to on the host
//! comes along as cargo's cache; cargo runs and decides that it is fresh). `CPF_SKIP_COMPOSE=1` skips the test, which takes
//! two minutes, and some more the first time.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Everything is compiled in this time, on however slow a machine.
const BUILD_PATIENCE: Duration = Duration::from_secs(1200);
/// A flight of 800 s at 20 times the speed, and getting up and down.
const FLIGHT_PATIENCE: Duration = Duration::from_secs(240);
const SHORT_PATIENCE: Duration = Duration::from_secs(90);

#[test]
fn a_fleet_in_containers_flies_and_leaves_its_run_on_the_host() {
    let scratch = tempfile::tempdir().expect("a temporary folder");
    let world = match World::make(scratch.path()) {
        Ok(world) => world,
        Err(reason) => {
            // Past the test harness, which shows the output of failed tests only.
            let _ = writeln!(std::io::stderr(), "compose: skipped, {reason}");
            return;
        }
    };

    world.compose(&["build"], BUILD_PATIENCE).expect_success();
    world.image_is_bare();
    world.emulator_ends_on_sigterm();

    // The fleet waits for its mission-control: how long it takes to look at it does not matter.
    world.compose(&["up", "-d", "emulator", "auv1", "auv2", "auv3"], SHORT_PATIENCE).expect_success();
    world.vehicles_reach_the_emulator_only();

    let up = ["up", "--no-color", "--exit-code-from", "mission-control"];
    let said = world.compose(&up, FLIGHT_PATIENCE).expect_success();
    // Not in what compose shows: it stops listening as soon as a vehicle has ended.
    let told = world.docker(&["logs", &world.container("mission-control")]).expect_success();
    assert!(told.contains("auv-helix finished") && told.contains("report: runs/"), "{told}");
    for service in ["emulator", "auv1", "auv2", "auv3", "mission-control"] {
        let container = world.container(service);
        assert_eq!(world.inspect(&container, "{{.State.ExitCode}}"), "0", "{service} ended by itself\n{said}");
    }
    world.run_is_complete();
}

// --- what is asserted --------------------------------------------------------------------------------------------------

impl World {
    /// An ordinary user, a signal that the programs know, and three programs; not even a shell.
    fn image_is_bare(&self) {
        let config = self.docker(&["image", "inspect", "-f", "{{.Config.User}} {{.Config.StopSignal}}", &self.name]);
        assert_eq!(config.expect_success().trim(), "10001:10001 SIGTERM");
        for program in ["network-emulator", "vehicle-node", "mission-control"] {
            let version = self.docker(&["run", "--rm", "--network", "none", &self.name, program, "--version"]);
            assert!(version.expect_success().starts_with(program));
        }
        let shell = self.docker(&["run", "--rm", "--network", "none", &self.name, "/bin/sh", "-c", "true"]);
        assert_ne!(shell.end().0, Some(0), "a shell in the image");
    }

    /// The first process of a container gets no default action for a signal: without a handler it would have to be killed.
    fn emulator_ends_on_sigterm(&self) {
        let name = format!("{}-term", self.name);
        let run = ["run", "-d", "--name", &name, "--network", "none", &self.name, "network-emulator"];
        self.docker(&run).expect_success();
        self.until("the emulator listens", || {
            self.docker(&["logs", &name]).expect_success().contains("tcp/127.0.0.1:7447")
        });
        self.docker(&["stop", "-t", "30", &name]).expect_success();
        let code = self.inspect(&name, "{{.State.ExitCode}}");
        self.docker(&["rm", "-f", &name]).expect_success();
        assert_eq!(code, "0", "ended as asked, not killed (137)");
    }

    /// Every vehicle has one network, the emulator is all that is there besides, and nothing passes from one to another.
    fn vehicles_reach_the_emulator_only(&self) {
        let emulator = self.container("emulator");
        let vehicles = ["auv1", "auv2", "auv3"];
        self.until("the emulator listens and has let everyone in", || {
            let told = self.docker(&["logs", &emulator]).expect_success();
            vehicles.iter().all(|vehicle| told.contains(&format!("{vehicle} joined")))
        });
        let address = |network: &str| {
            let path = format!("{{{{(index .NetworkSettings.Networks \"{}_{network}\").IPAddress}}}}", self.name);
            self.inspect(&emulator, &path)
        };
        for vehicle in vehicles {
            let container = self.container(vehicle);
            let network = format!("{}_{vehicle}", self.name);
            let joined = self.inspect(&container, "{{range $name, $_ := .NetworkSettings.Networks}}{{$name}} {{end}}");
            assert_eq!(joined.trim(), network, "{vehicle} has one network, its own");
            let form = "{{.Internal}}{{range .Containers}} {{.Name}}{{end}}";
            let seen = self.docker(&["network", "inspect", "-f", form, &network]).expect_success();
            let mut seen: Vec<&str> = seen.split_whitespace().collect();
            assert_eq!(seen.remove(0), "true", "{network} has no way out");
            assert_eq!(seen.len(), 2, "{vehicle} and the emulator: {seen:?}");
            assert!(seen.iter().any(|name| name.contains("emulator")), "{seen:?}");
        }
        // The emulator answers from the network of auv1, by name; but not by its address on the network of auv2, which
        // would be the way to auv2. (Nothing in a vehicle listens, so that a vehicle cannot be asked itself.)
        let ask = |whom: &str| {
            let network = format!("{}_auv1", self.name);
            let at = format!("tcp/{whom}:7447");
            let ask = ["run", "--rm", "--network", &network, &self.name, "mission-control", "status", "--attach", &at];
            self.docker(&ask).end()
        };
        let (code, said) = ask("emulator");
        assert_eq!(code, Some(0), "{said}");
        let (code, said) = ask(&address("auv1"));
        assert_eq!(code, Some(0), "{said}");
        let (code, said) = ask(&address("auv2"));
        assert_eq!(code, Some(3), "the network of auv2 was reached from that of auv1: {said}");
    }

    /// The run folder on the host is whole, and mission-control can read it again.
    fn run_is_complete(&self) {
        let folders: Vec<PathBuf> = fs::read_dir(&self.runs).expect("runs").map(|e| e.expect("entry").path()).collect();
        let [run] = folders.as_slice() else { panic!("one run: {folders:?}") };
        assert!(fs::read_to_string(run.join("report.html")).expect("report.html").contains("auv-helix"));
        let json = |name: &str| -> serde_json::Value {
            let text = fs::read_to_string(run.join(name)).expect(name);
            serde_json::from_str(&text).expect(name)
        };
        assert_eq!(json("summary.json")["complete"], true);
        assert_eq!(json("host.json")["missing"], serde_json::json!([]), "every log was collected");
        let recording = bus::recording::read(run.join("recording.mcap")).expect("recording.mcap");
        assert!(recording.complete && recording.damage.is_none());
        assert_eq!(
            recording.mission_toml,
            fs::read_to_string(self.root.join("missions/auv-helix.toml")).expect("mission")
        );

        let mount = format!("{}:/fleet/runs:ro", self.runs.display());
        let inside = format!("runs/{}", run.file_name().expect("name").to_string_lossy());
        let diff = ["run", "--rm", "-v", &mount, &self.name, "mission-control", "diff", &inside, &inside];
        self.docker(&diff).expect_success();
    }
}

// --- the world of containers, made for this test and taken away after it -------------------------------------------------

struct World {
    root: PathBuf,
    runs: PathBuf,
    /// Of the compose project, and of the image.
    name: String,
    /// `docker compose` or `docker-compose`.
    compose: Vec<&'static str>,
    scratch: PathBuf,
}

impl World {
    /// Makes the image to build in; or the reason why there can be none here.
    fn make(scratch: &Path) -> Result<World, String> {
        if std::env::var_os("CPF_SKIP_COMPOSE").is_some() {
            return Err("as CPF_SKIP_COMPOSE says".into());
        }
        let works = |command: &[&str]| {
            let done = Command::new(command[0]).args(&command[1..]).stdin(Stdio::null()).output();
            done.is_ok_and(|output| output.status.success())
        };
        if !works(&["docker", "version", "--format", "{{.Server.Version}}"]) {
            return Err("no Docker engine answers here".into());
        }
        let candidates = [vec!["docker", "compose"], vec!["docker-compose"]];
        let found = candidates.into_iter().find(|command| works(&[command.as_slice(), &["version"]].concat()));
        let compose = found.ok_or("Docker Compose is not installed")?;
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace").to_path_buf();
        let runs = scratch.join("runs");
        fs::create_dir(&runs).map_err(|error| error.to_string())?;
        let name = format!("cpf-test-{}", std::process::id());
        let world = World { root, runs, name, compose, scratch: scratch.to_path_buf() };

        let script = world.root.join("tests/compose/builder.sh");
        let made =
            world.start("bash", &[&script.to_string_lossy(), &world.builder(), &world.name, "dev"], BUILD_PATIENCE);
        match made.end() {
            (Some(0), _) => Ok(world),
            (Some(77), reason) => Err(reason.trim().into()),
            (_, said) => panic!("builder.sh failed:\n{said}"),
        }
    }

    fn builder(&self) -> String {
        format!("{}-builder", self.name)
    }

    fn docker(&self, arguments: &[&str]) -> Running {
        self.start("docker", arguments, SHORT_PATIENCE)
    }

    fn compose(&self, arguments: &[&str], patience: Duration) -> Running {
        let rest = [&self.compose[1..], &["-p", &self.name], arguments].concat();
        self.start(self.compose[0], &rest, patience)
    }

    fn start(&self, program: &str, arguments: &[&str], patience: Duration) -> Running {
        let (user, group) = (rustix::process::getuid().as_raw(), rustix::process::getgid().as_raw());
        let log =
            tempfile::NamedTempFile::new_in(&self.scratch).expect("a log").into_temp_path().keep().expect("a log");
        let both = || File::options().append(true).open(&log).expect("a log");
        let child = Command::new(program)
            .args(arguments)
            .current_dir(&self.root)
            .env("IMAGE", &self.name)
            .env("BUILDER", self.builder())
            .env("PROFILE", "dev")
            .env("RUNTIME", "scratch")
            .env("SUBNETS", "10.78")
            .env("RUNS", &self.runs)
            .env("CPF_USER", format!("{user}:{group}"))
            .env_remove("MISSION")
            .env_remove("SPEED_UP")
            .stdin(Stdio::null())
            .stdout(both())
            .stderr(both())
            .spawn()
            .unwrap_or_else(|error| panic!("cannot start {program}: {error}"));
        let command = format!("{program} {}", arguments.join(" "));
        Running { command, child: child.into(), log, deadline: Instant::now() + patience }
    }

    fn container(&self, service: &str) -> String {
        let ids = self.compose(&["ps", "-a", "-q", service], SHORT_PATIENCE).expect_success();
        ids.trim().to_string()
    }

    fn inspect(&self, container: &str, format: &str) -> String {
        self.docker(&["inspect", "-f", format, container]).expect_success().trim().to_string()
    }

    fn until(&self, what: &str, mut holds: impl FnMut() -> bool) {
        let deadline = Instant::now() + SHORT_PATIENCE;
        while !holds() {
            assert!(Instant::now() < deadline, "waited in vain until {what}");
            std::thread::sleep(Duration::from_millis(200));
        }
    }
}

impl Drop for World {
    /// Containers, networks and images go, those of the build too: they bear the builder's label.
    fn drop(&mut self) {
        let _ = self.compose(&["down", "--volumes", "--remove-orphans", "--timeout", "5"], SHORT_PATIENCE).end();
        let label = format!("label={}", self.name);
        let _ = self.docker(&["rm", "-f", &format!("{}-term", self.name)]).end();
        let _ = self.docker(&["rmi", "-f", &self.name]).end();
        let _ = self.docker(&["container", "prune", "-f", "--filter", &label]).end();
        let _ = self.docker(&["rmi", "-f", &self.builder()]).end();
        let _ = self.docker(&["image", "prune", "-f", "--filter", &label]).end();
    }
}

/// A command under way, and what it says.
struct Running {
    command: String,
    child: std::cell::RefCell<Child>,
    log: PathBuf,
    deadline: Instant,
}

impl Running {
    fn is_running(&self) -> bool {
        matches!(self.child.borrow_mut().try_wait(), Ok(None))
    }

    fn said(&self) -> String {
        String::from_utf8_lossy(&fs::read(&self.log).unwrap_or_default()).into_owned()
    }

    /// Its exit code, if it has one, and what it said; it is killed at its deadline.
    fn end(&self) -> (Option<i32>, String) {
        while self.is_running() {
            if Instant::now() > self.deadline {
                let _ = self.child.borrow_mut().kill();
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        let code = self.child.borrow_mut().wait().ok().and_then(|status| status.code());
        (code, self.said())
    }

    fn expect_success(&self) -> String {
        let (code, said) = self.end();
        assert_eq!(code, Some(0), "{} failed:\n{said}", self.command);
        said
    }
}
