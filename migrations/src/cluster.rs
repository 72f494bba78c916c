//! PostgreSQL servers of the tests' own: private folders and sockets, never a server of the machine.
//!
//! [`Database::fresh`] is for tests that want an empty database: all processes of a test run share one server, which is
//! started by the first of them and goes away some seconds after the last. [`Cluster::own`] is for tests that
//! stop and start a server. Nothing of either survives a power cut: they run with `fsync = off`.

use std::ffi::OsStr;
use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// Where Debian keeps the programs that are not in the path.
const DEBIAN: &str = "/usr/lib/postgresql";

/// The role that everything belongs to.
const ROLE: &str = "ground";

/// A server in a folder of its own. It is stopped when this goes away.
#[derive(Debug)]
pub struct Cluster {
    folder: PathBuf,
    is_own: bool,
}

impl Cluster {
    /// A server of the caller's own in this folder (which must exist and be empty), started.
    ///
    /// # Errors
    /// When PostgreSQL is not installed or does not start; the text says which.
    pub fn own(folder: &Path) -> io::Result<Self> {
        let cluster = Self { folder: folder.to_owned(), is_own: true };
        cluster.make()?;
        cluster.start()?;
        Ok(cluster)
    }

    fn make(&self) -> io::Result<()> {
        std::fs::set_permissions(&self.folder, std::fs::Permissions::from_mode(0o755))?;
        if is_root() {
            // PostgreSQL refuses to run as root.
            run(Command::new("chown").arg(user()).arg(&self.folder))?;
        }
        run(program("initdb").arg("--pgdata").arg(self.data()).args([
            "--username",
            ROLE,
            "--auth=trust",
            "--encoding=UTF8",
            "--locale=C",
            "--no-sync",
        ]))
    }

    fn data(&self) -> PathBuf {
        self.folder.join("data")
    }

    /// Starts the server and waits until it takes connections.
    ///
    /// # Errors
    /// When it does not.
    pub fn start(&self) -> io::Result<()> {
        let options = format!(
            "-c listen_addresses='' -c unix_socket_directories='{}' -c fsync=off -c full_page_writes=off \
             -c max_connections=200 -c shared_buffers=32MB -c autovacuum=off",
            self.folder.display()
        );
        run(program("pg_ctl")
            .args(["start", "--wait", "--silent", "--timeout=60", "--pgdata"])
            .arg(self.data())
            .arg("--log")
            .arg(self.folder.join("log"))
            .args(["--options", &options]))
    }

    /// Stops it at once, as a power cut would: clients see their connections end.
    ///
    /// # Errors
    /// When it does not stop.
    pub fn stop(&self) -> io::Result<()> {
        run(program("pg_ctl").args(["stop", "--mode=immediate", "--silent", "--pgdata"]).arg(self.data()))
    }

    /// An empty database; its address.
    ///
    /// # Errors
    /// When the server does not take it.
    pub fn database(&self, name: &str) -> io::Result<String> {
        self.tell("postgres", &format!("create database {name}"))?;
        Ok(self.address(name))
    }

    /// The address of a database by its name.
    pub fn address(&self, name: &str) -> String {
        format!("postgres://{ROLE}@localhost/{name}?host={}", self.folder.display())
    }

    /// Carries statements out, as whoever meddles would; what the server printed.
    ///
    /// # Errors
    /// What it said against it.
    pub fn tell(&self, database: &str, statements: &str) -> io::Result<String> {
        let output = self.psql(database, statements).output().map_err(|error| missing("psql", &error))?;
        if output.status.success() {
            return Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned());
        }
        Err(io::Error::other(String::from_utf8_lossy(&output.stderr).trim().to_owned()))
    }

    fn psql(&self, database: &str, statements: &str) -> Command {
        let mut command = Command::new("psql");
        command
            .args([
                "--no-psqlrc",
                "--quiet",
                "--tuples-only",
                "--no-align",
                "--set=ON_ERROR_STOP=1",
                "-U",
                ROLE,
                "-h",
            ])
            .arg(&self.folder)
            .args(["-d", database, "-c", statements]);
        command
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        if self.is_own {
            let _ = self.stop();
        }
    }
}

/// A database of the server that all tests of a run share; it goes away with this.
#[derive(Debug)]
pub struct Database {
    name: String,
}

impl Database {
    /// An empty one.
    ///
    /// # Errors
    /// When PostgreSQL is not installed or does not start; the text says which.
    pub fn fresh() -> io::Result<Self> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let name = format!("t_{}_{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        let cluster = shared()?;
        cluster.tell("postgres", &format!("drop database if exists {name} with (force)"))?;
        cluster.database(&name)?;
        Ok(Self { name })
    }

    /// Its address.
    ///
    /// # Errors
    /// As [`Database::fresh`].
    pub fn address(&self) -> io::Result<String> {
        Ok(shared()?.address(&self.name))
    }

    /// Sealed frames by station, as `name count` lines.
    ///
    /// # Errors
    /// What the server said against it.
    pub fn sealed_by_station(&self) -> io::Result<String> {
        self.tell("select station || ' ' || count(*) from sealed_frames group by station order by 1")
    }

    /// Commands that two stations sealed, or that were sealed by another than their own.
    ///
    /// # Errors
    /// What the server said against it.
    pub fn sealed_by_the_wrong_one(&self) -> io::Result<String> {
        self.tell(
            "select s.command from sealed_frames s join commands c on c.id = s.command where c.station <> s.station
             union select command from sealed_frames group by command having count(distinct station) > 1",
        )
    }

    /// Changes a row of the audit as somebody would who has the database and not our program.
    ///
    /// # Errors
    /// What the server said against it.
    pub fn tamper_with_the_audit(&self, row: i64) -> io::Result<()> {
        let change =
            format!("set session_replication_role = replica; update audit set who = 'eve' where id = {row}");
        self.tell(&change).map(drop)
    }

    /// Says that a program with a newer schema was here.
    ///
    /// # Errors
    /// What the server said against it.
    pub fn pretend_a_newer_schema(&self) -> io::Result<()> {
        self.tell("update _sqlx_migrations set version = 999 where version = 1").map(drop)
    }

    /// Chunks of an image that are held more than once, as `image|index` lines.
    ///
    /// # Errors
    /// What the server said against it.
    pub fn chunks_held_twice(&self) -> io::Result<String> {
        self.tell("select image, chunk_index from chunks group by image, chunk_index having count(*) > 1")
    }

    /// Puts the rows of a table there in the place of those here, whatever triggers and references say.
    ///
    /// # Errors
    /// What the server said against it.
    pub fn copy_rows(&self, from: &Self, table: &str) -> io::Result<()> {
        let rows = from.tell(&format!("copy {table} to stdout"))?;
        let rows = if rows.is_empty() { rows } else { rows + "\n" };
        self.tell_with(
            &format!("set session_replication_role = replica; delete from {table}"),
            &format!("set session_replication_role = replica; copy {table} from stdin"),
            &rows,
        )?;
        // Numbers that the database gives go on behind those that were copied.
        self.tell(&format!(
            "do $$ begin
               if exists (select from information_schema.columns
                          where table_name = '{table}' and column_name = 'id' and is_identity = 'YES') then
                 perform setval(pg_get_serial_sequence('{table}', 'id'), coalesce((select max(id) from {table}), 1));
               end if;
             end $$"
        ))
        .map(drop)
    }

    fn tell_with(&self, first: &str, then: &str, input: &str) -> io::Result<()> {
        let cluster = shared()?;
        let mut child = cluster
            .psql(&self.name, first)
            .args(["-c", then])
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()?;
        if let Some(mut stdin) = child.stdin.take() {
            io::Write::write_all(&mut stdin, input.as_bytes())?;
        }
        let output = child.wait_with_output()?;
        if output.status.success() {
            return Ok(());
        }
        Err(io::Error::other(String::from_utf8_lossy(&output.stderr).trim().to_owned()))
    }

    /// Carries statements out, as whoever meddles would; what the server printed.
    ///
    /// # Errors
    /// What it said against it.
    pub fn tell(&self, statements: &str) -> io::Result<String> {
        shared()?.tell(&self.name, statements)
    }
}

impl Drop for Database {
    fn drop(&mut self) {
        if let Ok(cluster) = shared() {
            let _ = cluster.tell("postgres", &format!("drop database if exists {} with (force)", self.name));
        }
    }
}

/// The server of the run, and the lock by which it is known to be in use.
fn shared() -> io::Result<&'static Cluster> {
    static SHARED: OnceLock<(Cluster, File)> = OnceLock::new();
    if let Some((cluster, _)) = SHARED.get() {
        return Ok(cluster);
    }
    let (cluster, used) = join()?;
    Ok(&SHARED.get_or_init(|| (cluster, used)).0)
}

fn join() -> io::Result<(Cluster, File)> {
    let own = std::fs::metadata("/proc/self")?.uid();
    let folder = std::env::temp_dir().join(format!("ground-tests-postgres-{own}"));
    let file = |kind| -> io::Result<File> {
        let path = folder.with_extension(kind);
        OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)
    };
    // Shared by all who use the server; whoever gets it alone may stop it.
    let used = file("used")?;
    used.lock_shared()?;
    let starting = file("starting")?;
    starting.lock()?;
    let cluster = Cluster { folder: folder.clone(), is_own: false };
    if cluster.tell("postgres", "select 1").is_err() {
        // What is left of an earlier run that was killed.
        if folder.join("data").exists() {
            let _ = cluster.stop();
            std::fs::remove_dir_all(&folder)?;
        }
        std::fs::create_dir_all(&folder)?;
        cluster.make()?;
        cluster.start()?;
        stop_when_unused(&cluster)?;
    }
    Ok((cluster, used))
}

/// Leaves a shell behind that stops the server once nobody has used it for some seconds.
fn stop_when_unused(cluster: &Cluster) -> io::Result<()> {
    let script = r#"
        while :; do
            flock --exclusive "$1.used" true
            sleep 5
            exec 9>"$1.starting"; flock --exclusive 9
            if flock --exclusive --nonblock "$1.used" true; then
                "$@" stop --mode=immediate --silent --pgdata "$1/data"
                rm -rf "$1"
                exit
            fi
            exec 9>&-
        done"#;
    let stop = program("pg_ctl");
    let shell = r#"folder=$1; shift; program="$*"; "#.to_owned()
        + &script.replace(r#""$@""#, "$program").replace("$1", "$folder");
    Command::new("setsid")
        .args(["sh", "-c", &shell, "sh"])
        .arg(&cluster.folder)
        .arg(stop.get_program())
        .args(stop.get_args())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .map(drop)
}

/// A program of the server, as a user who is not root.
fn program(name: &str) -> Command {
    let path = find(name);
    if !is_root() {
        return Command::new(path);
    }
    let mut command = Command::new("runuser");
    command.args(["-u", user(), "--"]).arg(path);
    command
}

fn find(name: &str) -> PathBuf {
    let newest = std::fs::read_dir(DEBIAN).into_iter().flatten().flatten().map(|entry| entry.path());
    let number = |path: &Path| -> u32 {
        path.file_name().and_then(OsStr::to_str).and_then(|name| name.parse().ok()).unwrap_or(0)
    };
    newest
        .max_by_key(|path| number(path))
        .map(|path| path.join("bin").join(name))
        .filter(|path| path.exists())
        .unwrap_or_else(|| PathBuf::from(name))
}

fn is_root() -> bool {
    std::fs::metadata("/proc/self").is_ok_and(|process| process.uid() == 0)
}

/// Who runs the server when we are root: the user that Debian's package makes.
fn user() -> &'static str {
    let users = std::fs::read_to_string("/etc/passwd").unwrap_or_default();
    if users.lines().any(|line| line.starts_with("postgres:")) { "postgres" } else { "nobody" }
}

fn missing(name: &str, error: &io::Error) -> io::Error {
    io::Error::other(format!("{name} does not run ({error}): install PostgreSQL (scripts/setup.sh tools)"))
}

fn run(command: &mut Command) -> io::Result<()> {
    let name = command.get_program().to_string_lossy().into_owned();
    // Not its standard streams: a server that is started keeps them open.
    let log = tempfile()?;
    let status = command
        .current_dir("/")
        .stdin(Stdio::null())
        .stdout(log.try_clone()?)
        .stderr(log.try_clone()?)
        .status()
        .map_err(|error| missing(&name, &error))?;
    if status.success() {
        return Ok(());
    }
    let mut told = String::new();
    io::Seek::rewind(&mut &log)?;
    io::Read::read_to_string(&mut &log, &mut told)?;
    Err(io::Error::other(format!("{command:?} failed: {}", told.trim())))
}

/// A file without a name.
fn tempfile() -> io::Result<File> {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    let number = NEXT.fetch_add(1, Ordering::Relaxed);
    let path = std::env::temp_dir().join(format!("ground-tests-{}-{number}.log", std::process::id()));
    let file = OpenOptions::new().read(true).write(true).create(true).truncate(true).open(&path)?;
    std::fs::remove_file(path)?;
    Ok(file)
}
