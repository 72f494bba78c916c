//! The archive in a file or in a PostgreSQL that logs each statement with all its parameters; and a database that asks for a
//! password.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::Command;
use std::sync::mpsc::{Receiver, channel};

use end_to_end::Folder;
use end_to_end::process::{gs_server, run};
use migrations::cluster::Cluster;
use tempfile::TempDir;

use super::look::{files, look_through};
use super::search::{Spellings, find};

/// Where the archive is.
pub(crate) enum Archive {
    /// In a file of the data folder.
    File,
    /// In a server of the test's own.
    Postgres { cluster: Cluster, folder: TempDir },
}

impl Archive {
    /// An empty one in a PostgreSQL, and a station that uses it with this password.
    pub(crate) fn postgres(station: &mut Folder, password: &str) -> Self {
        let folder = tempfile::Builder::new().prefix("gs-canary-").tempdir().expect("a folder");
        let cluster = Cluster::own(folder.path()).expect("a PostgreSQL");
        // Whoever runs it may log everything.
        for statement in ["alter system set log_statement = 'all'", "select pg_reload_conf()"] {
            cluster.tell("postgres", statement).expect("a setting");
        }
        let address = cluster.database("ground").expect("a database");
        station.write_key("database.password", &format!("{password}\n"), 0o600);
        station.storage = format!("database = \"{address}\"\npassword_file = \"database.password\"\n");
        Self::Postgres { cluster, folder }
    }

    /// Looks through the database's own files, its write-ahead log, what it logged, and a dump of it.
    pub(crate) fn scan(&self, spellings: &Spellings) {
        let Self::Postgres { cluster, folder } = self else { return };
        cluster.tell("postgres", "checkpoint").expect("a checkpoint");
        let names = look_through(folder.path(), &[], spellings);
        assert!(names.iter().any(|path| path.iter().any(|part| part == "pg_wal")), "{names:?}");
        let log = std::fs::read_to_string(folder.path().join("log")).expect("its log");
        let logged = |word: &str| log.to_lowercase().contains(word);
        assert!(logged("insert into") && logged("parameters: $1"), "it does not log what it is asked");
        let mut command = Command::new("pg_dump");
        command.args(["--username", "ground", "--dbname", "ground", "--host"]).arg(folder.path());
        let (code, dump, error) = run(command);
        assert_eq!(code, 0, "{error}");
        assert!(dump.contains("COPY public.commands"), "the dump is empty");
        assert_eq!(find(dump.as_bytes(), spellings), None, "pg_dump");
    }
}

/// Asks whoever connects for the password in the clear, as PostgreSQL may, keeps what was said, and refuses it.
fn strict_database() -> (SocketAddr, Receiver<Vec<u8>>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = listener.local_addr().expect("its address");
    let (told, heard) = channel();
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            // Whoever hung up said nothing; nobody listens any more when the test is over.
            let _ = refuse(stream).map(|said| told.send(said));
        }
    });
    (address, heard)
}

fn refuse(mut stream: TcpStream) -> std::io::Result<Vec<u8>> {
    let mut piece = [0; 4096];
    let _startup = stream.read(&mut piece)?;
    // AuthenticationCleartextPassword
    stream.write_all(b"R\0\0\0\x08\0\0\0\x03")?;
    let count = stream.read(&mut piece)?;
    let fields = b"SFATAL\0VFATAL\0C28P01\0Mpassword authentication failed for user \"ground\"\0\0";
    stream.write_all(b"E")?;
    stream.write_all(&(4 + fields.len() as u32).to_be_bytes())?;
    stream.write_all(fields)?;
    Ok(piece[..count].to_vec())
}

#[test]
fn the_password_of_the_database_stays_in_its_file() {
    const PASSWORD: &str = super::DATABASE_PASSWORD;
    let secrets = vec![("raw password".to_owned(), PASSWORD.as_bytes().to_vec())];
    let (address, heard) = strict_database();
    let mut folder = Folder::new();
    folder.write_key("database.password", &format!("{PASSWORD}\n"), 0o600);
    let ask = |folder: &Folder, verb: &[&str]| {
        let config = folder.write_config();
        let mut command = gs_server(["--log", "trace"]);
        command.args(verb).arg("--config").arg(config);
        let (code, out, error) = run(command);
        assert_ne!(code, 0, "{verb:?}: {out}");
        let all = format!("{out}{error}");
        assert_eq!(find(all.as_bytes(), &secrets), None, "{verb:?}: {all}");
        all
    };
    folder.storage = format!(
        "database = \"postgres://ground@{address}/ground?sslmode=disable\"\npassword_file = \"database.password\"\n"
    );
    let told = ask(&folder, &["serve"]);
    assert!(told.contains("the archive cannot be opened"), "{told}");
    let said = heard.recv().expect("what it was asked with");
    assert!(find(&said, &secrets).is_some(), "the password was never used");
    // A file that others may read, and a password where it does not belong: refused, and not repeated.
    folder.write_key("database.password", &format!("{PASSWORD}\n"), 0o644);
    ask(&folder, &["serve"]);
    folder.storage = format!("database = \"postgres://ground:{PASSWORD}@{address}/ground\"\n");
    ask(&folder, &["serve"]);
    ask(&folder, &["config", "check"]);
    folder.storage = format!("database = \"postgres://ground@{address}/ground?password={PASSWORD}\"\n");
    ask(&folder, &["serve"]);
    for path in files(folder.path()) {
        if path == folder.file("database.password") || path == folder.file("station.toml") {
            continue;
        }
        let bytes = std::fs::read(&path).expect("a file");
        assert_eq!(find(&bytes, &secrets), None, "{}", path.display());
    }
}
