use super::*;

#[test]
fn val_the_endpoints_that_a_service_listens_on_are_known() -> Result<(), Box<dyn std::error::Error>> {
    let listening = |listen: &str| {
        let options = BusOptions { listen: vec![listen.to_owned()], ..BusOptions::default() };
        options.service_config().map(|config| endpoints_of(&config))
    };
    assert_eq!(listening("tcp/127.0.0.1:7500#so_sndbuf=65536")?, ["tcp/127.0.0.1:7500"]);
    let chosen = listening("tcp/127.0.0.1:0")?;
    let port = chosen[0].strip_prefix("tcp/127.0.0.1:").ok_or("another address")?.parse::<u16>()?;
    assert!(chosen.len() == 1 && port != 0, "{chosen:?}");
    let free = BusOptions::default().service_config().map(|config| endpoints_of(&config))?;
    assert!(free[0].starts_with("tcp/127.0.0.1:74"), "{free:?}");
    Ok(())
}

#[test]
fn prop_an_endpoint_open_to_the_network_without_passwords_is_known() -> Result<(), Box<dyn std::error::Error>> {
    for (endpoint, is_open) in [
        ("127.0.0.1:7", false),
        ("[::1]:7", false),
        ("localhost:7", false),
        ("0.0.0.0:7", true),
        ("[::]:7", true),
        ("host:7", true),
    ] {
        let options = BusOptions { listen: vec![format!("tcp/{endpoint}")], ..BusOptions::default() };
        let mut config = options.service_config()?;
        assert_eq!(!open_endpoints(&config).is_empty(), is_open, "{endpoint}");
        set(&mut config, "access_control/enabled", "true")?;
        assert!(open_endpoints(&config).is_empty(), "{endpoint}");
    }
    Ok(())
}

#[test]
fn prop_a_configuration_file_opens_no_more_than_it_states() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("zenoh.json5");
    let options = BusOptions { config: Some(file.clone()), ..BusOptions::default() };
    let value = |config: Config, key: &str| config.get_json(key).unwrap_or_default();
    std::fs::write(&file, r#"{ transport: { link: { tx: { lease: 5000 } } }, connect: { endpoints: ["tcp/127.0.0.1:9"] } }"#)?;
    let listens = value(options.service_config()?, LISTEN);
    assert!(listens.contains("tcp/127.0.0.1:") && !listens.contains("[::]"), "{listens}");
    assert_eq!(value(options.client_config()?, LISTEN), "[]");
    assert_eq!(value(options.service_config()?, MULTICAST), "false");
    assert!(value(options.service_config()?, CONNECT).contains("tcp/127.0.0.1:9"));
    std::fs::write(&file, r#"{ listen: { endpoints: ["tcp/127.0.0.2:0"] }, scouting: { multicast: { enabled: true } } }"#)?;
    for config in [options.service_config()?, options.client_config()?] {
        assert_eq!(value(config.clone(), MULTICAST), "true");
        assert!(value(config, LISTEN).contains("tcp/127.0.0.2:0"));
    }
    Ok(())
}

/// zenoh ignores passwords in a build without them: such a service was open to everybody.
#[cfg(not(feature = "tls"))]
#[test]
fn regress_passwords_are_refused_in_a_build_without_them() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("zenoh.json5");
    let options = BusOptions { config: Some(file.clone()), ..BusOptions::default() };
    for (keys, key) in [
        (r#"dictionary_file: "users.txt""#, "transport/auth/usrpwd/dictionary_file"),
        (r#"user: "viewer", password: "a""#, "transport/auth/usrpwd/user"),
    ] {
        std::fs::write(&file, format!("{{ transport: {{ auth: {{ usrpwd: {{ {keys} }} }} }} }}"))?;
        for opened in [options.open_service(), options.open_client()] {
            let refused = opened.map(|_| ()).map_err(|error| error.to_string());
            let why = format!("this build has no passwords, which {key} needs: build it with `--features tls`");
            assert_eq!(refused, Err(format!("zenoh configuration: {why}")));
        }
    }
    Ok(())
}

/// It took the port, and then waited for itself.
#[test]
fn regress_a_service_listens_on_no_port_that_it_is_to_connect_to() -> Result<(), Box<dyn std::error::Error>> {
    let listening = |options: &BusOptions| -> Result<String, Box<dyn std::error::Error>> {
        Ok(endpoints_of(&options.service_config()?).pop().ok_or("listens nowhere")?)
    };
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("zenoh.json5");
    let first = listening(&BusOptions::default())?;
    let port = first.strip_prefix("tcp/127.0.0.1:").ok_or("another address")?;
    for host in ["localhost", "127.0.0.1", "[::1]"] {
        let connect = format!("tcp/{host}:{port}");
        let named = BusOptions { connect: vec![format!("{connect}#so_sndbuf=65536")], gossip: true, ..BusOptions::default() };
        std::fs::write(&file, format!("{{ connect: {{ endpoints: [{connect:?}] }} }}"))?;
        let of_file = BusOptions { config: Some(file.clone()), ..BusOptions::default() };
        for options in [named, of_file] {
            assert_ne!(listening(&options)?, first, "{connect}");
        }
    }
    assert_eq!(local_port(&format!("tcp/192.0.2.1:{port}")), None, "of another machine");
    Ok(())
}

/// A mute program on a port of this machine's services kept a session from closing for ten seconds.
#[test]
fn regress_a_mute_program_on_a_port_keeps_no_session_open() -> Result<(), Box<dyn std::error::Error>> {
    let mut ports = PORTS;
    let mute = ports.find_map(|port| TcpListener::bind(loopback(port)).ok()).ok_or("no free port")?;
    let (session, _) = BusOptions::default().open_listening()?;
    let asked = std::time::Instant::now();
    session.close().wait().map_err(|error| error.to_string())?;
    let took = asked.elapsed();
    assert!(took < Duration::from_secs(6), "{took:?}");
    drop(mute);
    Ok(())
}
