use std::{
    cell::Cell,
    fmt::Write as _,
    io::{Cursor, Write as _},
};

use crate::{BYTES_MAX, Place, Route, read, read_until, select};

/// (latitude, longitude) of a small survey.
const PLACES: [(f64, f64); 3] = [(38.7, -9.2), (38.701, -9.2), (38.701, -9.199)];

fn list(each: impl Fn(f64, f64) -> String, between: &str) -> String {
    PLACES.map(|(lat, lon)| each(lat, lon)).join(between)
}

fn kml() -> String {
    let line = list(|lat, lon| format!("{lon},{lat},-5"), " ");
    format!(
        "<?xml version=\"1.0\"?><kml xmlns=\"http://www.opengis.net/kml/2.2\"><Document><name>all</name><Placemark><name>a &amp; b</name>\
         <LineString><coordinates>\n{line}\n</coordinates></LineString></Placemark></Document></kml>"
    )
}

fn plan() -> String {
    let items = list(
        |lat, lon| {
            format!(r#"{{"type":"SimpleItem","command":16,"frame":3,"params":[0,0,0,null,{lat},{lon},-4]}}"#)
        },
        ",",
    );
    format!(r#"{{"fileType":"Plan","mission":{{"cruiseSpeed":1.5,"items":[{items}]}}}}"#)
}

fn wpl() -> String {
    let mut text = String::from("QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t38.6\t-9.3\t20\t1\n");
    for (k, (lat, lon)) in PLACES.iter().enumerate() {
        let _ = writeln!(text, "{}\t0\t3\t16\t0\t0\t0\t0\t{lat}\t{lon}\t0\t1", k + 1);
    }
    text
}

fn rtz() -> String {
    let points = list(
        |lat, lon| {
            format!(
                "<waypoint id=\"1\" radius=\"0.01\"><position lat=\"{lat}\" lon=\"{lon}\"/><leg speedMax=\"3\"/></waypoint>"
            )
        },
        "",
    );
    format!("<route version=\"1.0\"><routeInfo routeName=\"a\"/><waypoints>{points}</waypoints></route>")
}

fn gpx(route: &str, point: &str) -> String {
    let points = list(
        |lat, lon| format!("<{point} lat=\"{lat}\" lon=\"{lon}\"><ele>3</ele></{point}>"),
        "\n",
    );
    let inner = if route == "trk" {
        format!("<trkseg>{points}</trkseg>")
    } else {
        points
    };
    format!("<gpx version=\"1.1\"><{route}><name>a</name>{inner}</{route}></gpx>")
}

fn geojson(kind: &str, open: &str, close: &str) -> String {
    let line = list(|lat, lon| format!("[{lon},{lat}]"), ",");
    format!(
        r#"{{"type":"FeatureCollection","features":[{{"type":"Feature","properties":{{"name":"a"}},"geometry":{{"type":"{kind}","coordinates":{open}{line}{close}}}}}]}}"#
    )
}

fn kmz(kml: &[u8]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    zip.start_file("doc.kml", zip::write::SimpleFileOptions::default())
        .expect("in memory");
    zip.write_all(kml).expect("in memory");
    zip.finish().expect("in memory").into_inner()
}

/// A file of each kind on Earth.
fn files() -> Vec<Vec<u8>> {
    let csv = |head: &str, between: &str| {
        format!(
            "{head}\n{}",
            list(|lat, lon| format!("{lat}{between}{lon}"), "\n")
        )
    };
    let utf16 = |text: &str| {
        let units = std::iter::once(0xFEFF).chain(text.encode_utf16());
        units.flat_map(u16::to_le_bytes).collect::<Vec<u8>>()
    };
    vec![
        kml().into_bytes(),
        kmz(kml().as_bytes()),
        utf16(&kml()),
        format!("\u{feff}{}", gpx("rte", "rtept")).into_bytes(),
        gpx("trk", "trkpt").into_bytes(),
        rtz().into_bytes(),
        plan().into_bytes(),
        wpl().into_bytes(),
        geojson("LineString", "[", "]").into_bytes(),
        geojson("MultiLineString", "[[", "]]").into_bytes(),
        geojson("Polygon", "[[", ",[-9.2,38.7]]]").into_bytes(),
        csv("lat,lon", ",").into_bytes(),
        csv("Latitude;Longitude", ";").replace('.', ",").into_bytes(),
    ]
}

#[test]
fn files_of_every_planning_tool_have_the_same_route() {
    for file in files() {
        let shown = String::from_utf8_lossy(&file).into_owned();
        let route = select(read(&file).expect(&shown), None).expect(&shown);
        let places: Vec<_> = route.points.iter().map(|point| point.place).collect();
        let expected = PLACES.map(|(lat_deg, lon_deg)| Place::Earth { lat_deg, lon_deg });
        assert_eq!(places, expected, "{shown}");
        assert_eq!(route.closed, shown.contains("Polygon"));
    }
}

#[test]
fn depth_speed_radius_and_names_are_read_in_their_units() {
    let first = |file: &str| read(file.as_bytes()).expect(file)[0].points[0];
    assert_eq!(first(&kml()).depth_m, Some(5.0));
    assert_eq!(read(kml().as_bytes()).expect("is KML")[0].name, "a & b");
    assert_eq!(first(&plan()).speed_mps, Some(1.5));
    assert_eq!(first(&plan()).depth_m, Some(4.0));
    assert_eq!(first(&gpx("trk", "trkpt")).depth_m, None);
    let point = first(&rtz());
    assert!((point.turn_radius_m.expect("is given") - 18.52).abs() < 1e-9);
    assert!((point.speed_mps.expect("is given") - 1.543).abs() < 1e-3);
}

#[test]
fn points_of_moos_have_east_first_and_lawnmowers_their_lanes() {
    let local = |route: &Route| -> Vec<(f64, f64)> {
        let each = route.points.iter().map(|point| match point.place {
            Place::Local([north_m, east_m]) => (north_m, east_m),
            Place::Earth { .. } => panic!("{point:?}"),
        });
        each.collect()
    };
    let routes =
        read(b"// survey\npoints = pts={0,1:10,2},label=a\npolygon = 0,0:5,0:5,5 // loiter\n").expect("MOOS");
    assert_eq!(local(&routes[0]), [(1.0, 0.0), (2.0, 10.0)]);
    assert!(routes[0].name == "a" && routes[1].closed);
    let mower = "points = format=lawnmower, label=b, x=100, y=0, width=200, height=40, lane_width=20, rows=ew, degs=0";
    let route = select(read(mower.as_bytes()).expect(mower), Some("b")).expect(mower);
    let lanes = local(&route);
    assert_eq!(lanes.len(), 4);
    for (k, (north, east)) in lanes.iter().enumerate() {
        assert!((north.abs() - 10.0).abs() < 1e-9, "{lanes:?}");
        let expected = if k == 0 || k == 3 { 0.0 } else { 200.0 };
        assert!((east - expected).abs() < 1e-9, "{lanes:?}");
    }
}

#[test]
fn what_cannot_be_read_is_named_with_its_place() {
    for (file, place, fault) in [
        (kml().replace("38.701,", "98.701,"), "line 2", "not on Earth"),
        (kml().replace("</Document>", ""), "line 3", "is no XML"),
        (
            geojson("LineString", "[", ",[1]]"),
            "line 1 (/features/0/geometry/coordinates/3)",
            "latitude",
        ),
        (wpl().replace("\t3\t", "\t"), "line 3", "11 columns"),
        (rtz().replace("0.01", "1e308"), "line 1", "radius is too large"),
        ("lat,lon\n38,x\n".to_owned(), "line 2", "no number"),
        ("x,y\n1,2\n".to_owned(), "line 1", "needs the columns"),
        (plan().replace(":16", ":1000"), "file", "has no route"),
        (
            gpx("rte", "rtept").replace("lat=", &format!("a='{}' lat=", "b".repeat(1 << 16))),
            "line 1",
            "at most 65536",
        ),
        (String::new(), "file", "is empty"),
    ] {
        let error = read(file.as_bytes()).expect_err(&file);
        assert!(
            error.place == place && error.fault.contains(fault),
            "{error} of {file}"
        );
    }
    let two = format!("<gpx>{}{}</gpx>", gpx("rte", "rtept"), gpx("rte", "rtept"));
    assert!(select(read(two.as_bytes()).expect("is GPX"), None).is_err());
}

#[test]
fn bombs_are_refused() {
    let bomb = kmz(&vec![b' '; BYTES_MAX + 1]);
    assert!(read(&bomb).expect_err("is large").fault.contains("unpacked"));
    let lol = "<!DOCTYPE l [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;&a;&a;\">]>";
    let entities = kml()
        .replace("<kml", &format!("{lol}<kml"))
        .replace("a &amp; b", "&b;");
    assert_eq!(read(entities.as_bytes()).expect("is KML")[0].name, "");
    assert!(read("<a>".repeat(1_000_000).as_bytes()).is_err());
    assert!(read("[".repeat(1_000_000).as_bytes()).is_err());
}

/// The dearest files of each kind, of so many bytes: of the shortest pieces of which something is kept or passed over.
fn dear(bytes: usize) -> Vec<(&'static str, String)> {
    let filled = |before: &str, piece: &str, after: &str| {
        let n = (bytes - before.len() - after.len()) / piece.len();
        format!("{before}{}{after}", piece.repeat(n))
    };
    let line = r#"{"type":"LineString","coordinates":["#;
    let nested = format!("{}{},", "[".repeat(100), "]".repeat(100));
    vec![
        ("MOOS without points", filled("points=0,0\n", "points=\n", "")),
        ("MOOS of one point", filled("", "points=0,0\n", "")),
        ("MOOS in one line", filled("pts={", "0,0:", "}")),
        (
            "lanes",
            filled(
                "",
                "format=lawnmower,x=0,y=0,width=1,height=1e5,lane_width=1\n",
                "",
            ),
        ),
        (
            "a way-point list",
            filled("QGC WPL 110\n", "0 0 0 16 0 0 0 0 1 1 0 0\n", ""),
        ),
        ("a line of numbers", filled("QGC WPL 110\n", "0 ", "")),
        ("columns", filled("lat,lon", ",", "\n1,1")),
        ("columns of one line", filled("lat,lon\n1,1", ",", "")),
        ("routes of a table", filled("lat,lon,name\n", "1,1,a\n1,1,\n", "")),
        ("nested lists", filled("[", &nested, "0]")),
        ("objects", filled("[", "{},", "0]")),
        ("members", filled("{", "\"\":0,", "\"\":0}")),
        ("a line of GeoJSON", filled(line, "[1,1],", "[1,1]]}")),
        (
            "as long a line as is read",
            format!("{line}{}[1,1]]}}", "[1,1],".repeat(170_000)),
        ),
        (
            "as many objects as are read",
            format!("[{}0]", "{},".repeat(50_000)),
        ),
        ("a text", filled("[\"", "\\n", "\"]")),
        (
            "a line of KML",
            filled(
                "<kml><Placemark><coordinates>",
                "1,1 ",
                "</coordinates></Placemark></kml>",
            ),
        ),
        (
            "one tuple of KML",
            filled("<Placemark><coordinates>", "1,", "</coordinates></Placemark>"),
        ),
        ("a track", filled("<trk>", "<trkpt lat='1' lon='1'/>", "</trk>")),
        (
            "routes",
            filled("<gpx>", "<rte><rtept lat='1' lon='1'/></rte>", "</gpx>"),
        ),
        (
            "attributes",
            filled("<gpx><wpt lat='1' ", "a='' ", "lon='1'/></gpx>"),
        ),
        ("elements", filled("<gpx>", "<a/>", "</gpx>")),
        ("lines", filled("<gpx>", "\n", "</gpx>")),
    ]
}

#[test]
fn no_file_takes_more_than_eight_times_the_memory_of_the_largest() {
    for (kind, file) in dear(BYTES_MAX) {
        let file = kmz(file.as_bytes());
        let taken = allocation_counter::measure(|| drop(read(&file)));
        let mib = taken.bytes_max >> 20;
        println!("{kind}: {mib} MiB for {} bytes", file.len());
        assert!(mib <= 64, "{kind}: {mib} MiB");
    }
}

#[test]
fn a_file_is_given_up_once_it_is_due() {
    for (kind, file) in dear(1 << 20) {
        let looks = Cell::new(0);
        let n_looks = |due_at: u32| {
            looks.set(0);
            let due = || due_at <= looks.replace(looks.get() + 1);
            let routes = read_until(file.as_bytes(), &due);
            (looks.get(), routes.err())
        };
        let (whole, _) = n_looks(u32::MAX);
        for due_at in [0, whole / 2] {
            let (looks, error) = n_looks(due_at);
            assert!(
                whole == 0 || (looks <= due_at + 5 && error.is_some()),
                "{kind}: {looks} of {whole}"
            );
        }
    }
}

#[test]
fn ten_thousand_damaged_files_are_read_or_refused() {
    let files = files();
    let (mut random, mut n_read) = (1_u64, 0);
    for k in 0..10_000 {
        let mut file = files[k % files.len()].clone();
        let mut next = |below: usize| {
            random = random
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            usize::try_from(random >> 33).expect("31 bits") % below
        };
        for _ in 0..=next(4) {
            let (at, to) = (next(file.len()), next(file.len()));
            match next(4) {
                0 => file[at] = u8::try_from(next(256)).expect("a byte"),
                1 => file.truncate(at.max(1)),
                2 => drop(file.drain(at.min(to)..at.max(to).min(file.len() - 1).max(at.min(to)))),
                _ => {
                    let part = file[at.min(to)..at.max(to)].to_vec();
                    file.splice(at..at, part);
                }
            }
        }
        if let Ok(routes) = read(&file) {
            n_read += 1;
            assert!(routes.iter().all(|route| !route.points.is_empty()));
        }
    }
    println!("{n_read} of 10000 damaged files were read");
    assert!(0 < n_read && n_read < 10_000);
}
