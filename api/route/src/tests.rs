use std::cell::Cell;
use std::fmt::Write as _;
use std::io::{Cursor, Write as _};

use crate::{BYTES_MAX, Place, Route, read, read_until, select};

/// (latitude, longitude) of a small survey.
const PLACES: [(f64, f64); 3] = [(38.7, -9.2), (38.701, -9.2), (38.701, -9.199)];

fn on_earth((lat_deg, lon_deg): (f64, f64)) -> Place {
    Place::Earth { lat_deg, lon_deg }
}

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
    mission([""; 3]).replace(' ', "\t").replace("QGC\tWPL\t", "QGC WPL ")
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
    let points =
        list(|lat, lon| format!("<{point} lat=\"{lat}\" lon=\"{lon}\"><ele>3</ele></{point}>"), "\n");
    let inner = if route == "trk" { format!("<trkseg>{points}</trkseg>") } else { points };
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
    zip.start_file("doc.kml", zip::write::SimpleFileOptions::default()).expect("in memory");
    zip.write_all(kml).expect("in memory");
    zip.finish().expect("in memory").into_inner()
}

/// A file of each kind on Earth.
fn files() -> Vec<Vec<u8>> {
    let csv = |head: &str, between: &str| {
        format!("{head}\n{}", list(|lat, lon| format!("{lat}{between}{lon}"), "\n"))
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
        assert_eq!(places, PLACES.map(on_earth), "{shown}");
        assert_eq!(route.closed, shown.contains("Polygon"));
    }
}

#[test]
fn depth_speed_radius_and_names_are_read_in_their_units() {
    let first = |file: &str| read(file.as_bytes()).expect(file)[0].points[0];
    assert_eq!(first(&kml()).depth_m, Some(5.0));
    assert_eq!(read(kml().as_bytes()).expect("is KML")[0].name, "a & b");
    assert_eq!(first(&plan()).depth_m, Some(4.0));
    assert_eq!(first(&gpx("trk", "trkpt")).depth_m, None);
    let point = first(&rtz());
    assert!((point.turn_radius_m.expect("is given") - 18.52).abs() < 1e-9);
    assert!((point.speed_mps.expect("is given") - 1.543).abs() < 1e-3);
}

/// (north, east) of a route in metres.
fn local(route: &Route) -> Vec<(f64, f64)> {
    let each = route.points.iter().map(|point| match point.place {
        Place::Local([north_m, east_m]) => (north_m, east_m),
        Place::Earth { .. } => panic!("{point:?}"),
    });
    each.collect()
}

fn only(file: &str) -> Route {
    select(read(file.as_bytes()).expect(file), None).expect(file)
}

#[test]
fn points_of_moos_have_east_first_and_their_labels() {
    let text = b"// survey\npoints = pts={0,1:10,2},label=a\npolygon = 0,0:5,0:5,5 // loiter\n";
    let routes = read(text).expect("MOOS");
    assert_eq!(local(&routes[0]), [(1.0, 0.0), (2.0, 10.0)]);
    assert!(routes[0].name == "a" && routes[1].closed);
    for list in ["label,a : 0,1 : 10,2 : active,true : vertex_size,3", "points = label=a, pts={0,1:10,2}"] {
        assert_eq!(only(list), routes[0], "{list}");
    }
}

#[test]
fn a_behaviour_of_moos_sets_speed_order_and_repetition_of_its_points() {
    let block = |more: &str| {
        format!(
            "initialize DEPLOY = false\n\nBehavior = BHV_Waypoint\n{{\n name = lanes\n pwt = 100\n speed = 1.4 // m/s\n {more}\n \
             points = 10,-20 : 10,-140 : 30,-140\n}}\nBehavior = BHV_Loiter\n{{\n polygon = pts={{0,0:5,0:5,5}}\n}}\n"
        )
    };
    let once = [(-20.0, 10.0), (-140.0, 10.0), (-140.0, 30.0)];
    for (more, expected, closed) in [
        ("repeat = 0", once.to_vec(), false),
        ("repeat = 2", [once; 3].concat(), false),
        ("repeat = forever", once.to_vec(), true),
        ("order = reverse", [once[2], once[1], once[0]].to_vec(), false),
    ] {
        let routes = read(block(more).as_bytes()).expect("MOOS");
        assert_eq!(routes.len(), 2);
        assert_eq!((local(&routes[0]), routes[0].closed), (expected, closed), "{more}");
        assert_eq!((&*routes[0].name, routes[0].speed_mps()), ("lanes", Some(1.4)));
        assert_eq!((&*routes[1].name, routes[1].speed_mps()), ("", None));
    }
}

#[test]
fn lawnmowers_of_moos_have_a_lane_on_the_edge_and_begin_near_the_start() {
    // East and west over 200 m by 40 m, from the corner nearest to the origin, south-west.
    let mower =
        "points = format=lawnmower, label=b, x=100, y=25, width=200, height=40, swath=20, rows=ew, degs=0";
    let route = only(mower);
    let lane = |north, ends: [f64; 2]| ends.map(|east| (north, east));
    let (out, home) = ([0.0, 200.0], [200.0, 0.0]);
    let lanes = [lane(5.0, out), lane(25.0, home), lane(45.0, out)].concat();
    let off = |route: &Route, expected: &[(f64, f64)]| {
        let pairs = local(route).into_iter().zip(expected.iter().copied());
        assert_eq!(route.points.len(), expected.len());
        pairs.map(|(a, b)| (a.0 - b.0).hypot(a.1 - b.1)).fold(0.0, f64::max)
    };
    assert!(route.name == "b" && off(&route, &lanes) < 1e-9, "{route:?}");
    // From the other end of the last lane, the same lanes run in reverse.
    let back: Vec<_> = lanes.iter().rev().copied().collect();
    let from_the_far_corner = format!("{}, startx=210, starty=50", mower.replace("swath", "lane_width"));
    assert!(off(&only(&from_the_far_corner), &back) < 1e-9);
    // A quarter turn clockwise about the centre: lanes to the north over the same area.
    let turned =
        "format=lawnmower,x=100,y=25,width=40,height=200,swath=20,rows=ns,degs=90,startx=-9,starty=0";
    assert!(off(&only(turned), &lanes) < 1e-9, "{:?}", only(turned));
    // Lanes that do not fit go beyond the edge, here by 5 m.
    let wide = only(&mower.replace("height=40", "height=35"));
    assert_eq!(wide.points.len(), 6);
    assert!((local(&wide)[5].0 - local(&wide)[0].0 - 40.0).abs() < 1e-9);
}

/// A way-point list: home, three way-points numbered from 1, and these lines after the k-th.
fn mission(after: [&str; 3]) -> String {
    let mut text = String::from("QGC WPL 110\n0 1 0 16 0 0 0 0 38.6 -9.3 20 1\n");
    for (k, (lat, lon)) in PLACES.iter().enumerate() {
        let _ = writeln!(text, "{} 0 3 16 0 0 0 0 {lat} {lon} 0 1\n{}", k + 1, after[k]);
    }
    text
}

#[test]
fn commands_for_aircraft_are_noted() {
    let items = "4 0 3 22 0 0 0 0 38.6 -9.3 20 1\n5 0 3 21 0 0 0 0 38.6 -9.3 0 1\n6 0 3 20 0 0 0 0 0 0 0 1";
    let notes = only(&mission(["", "", items])).left_out();
    let has = |k: usize, word| notes.get(k).is_some_and(|note| note.contains(word));
    assert!(has(0, "aircraft") && has(1, "return") && notes.len() == 2, "{notes:?}");
}

#[test]
fn a_jump_repeats_its_part_as_often_as_stated() {
    let sailed = |after: [&str; 3]| {
        let route = only(&mission(after));
        let places = PLACES.map(on_earth);
        let number = |place| places.iter().position(|known| *known == place).expect("is one");
        let points = route.points.iter();
        let points: Vec<_> = points.map(|point| (number(point.place), point.speed_mps)).collect();
        (points, route.closed, route.left_out())
    };
    let of = |points: &[usize]| points.iter().map(|k| (*k, None)).collect::<Vec<_>>();
    let jump = |to: u32, times: i32| format!("9 0 3 177 {to} {times} 0 0 0 0 0 1");
    assert_eq!(sailed(["", "", &jump(1, 0)]), (of(&[0, 1, 2]), false, vec![]));
    assert_eq!(sailed(["", "", &jump(2, 2)]), (of(&[0, 1, 2, 1, 2, 1, 2]), false, vec![]));
    assert_eq!(sailed(["", &jump(1, 1), ""]), (of(&[0, 1, 0, 1, 2]), false, vec![]));
    assert_eq!(sailed(["", "", &jump(1, -1)]), (of(&[0, 1, 2]), true, vec![]));
    // Nothing follows a jump without end; way-points before its part are noted.
    assert_eq!(sailed(["", &jump(1, -1), ""]), (of(&[0, 1]), true, vec![]));
    let (points, closed, notes) = sailed(["", "", &jump(2, -1)]);
    assert!((points, closed) == (of(&[1, 2]), true) && notes[0].ends_with("left out: 1"), "{notes:?}");
    // A speed holds until the next one, also on the way back. Speeds of climbing do not count.
    let speed = |kind: u32, speed: f64| format!("8 0 3 178 {kind} {speed} 0 0 0 0 0 1");
    let (slow, fast) = (speed(1, 0.5), format!("{}\n{}", jump(1, 1), speed(2, 9.0)));
    let (points, ..) = sailed([&slow, &speed(0, 1.5), &fast]);
    let [slow, fast] = [Some(0.5), Some(1.5)];
    assert_eq!(points, [(0, None), (1, slow), (2, fast), (0, fast), (1, slow), (2, fast)]);
    for (to, times) in [(7, 1), (9, 1)] {
        let error = read(mission(["", "", &jump(to, times)]).as_bytes()).expect_err("is nowhere");
        assert!(error.place == "line 8" && error.fault.contains("write its legs out"), "{error}");
    }
    assert!(read(mission(["", "", &jump(1, i32::MAX)]).as_bytes()).is_err());
}

#[test]
fn a_plan_has_only_the_speeds_of_its_items() {
    assert_eq!(only(&plan()).speed_mps(), None);
    let changed = plan().replacen("[{", r#"[{"type":"SimpleItem","command":178,"params":[1,1.2,-1]},{"#, 1);
    assert_eq!(only(&changed).speed_mps(), Some(1.2));
}

#[test]
fn way_points_with_different_names_are_one_route() {
    for (names, n_routes) in [(["WP1", "WP2", "WP3"], 1), (["1", "", "1"], 1), (["a", "a", "b"], 2)] {
        let rows = PLACES.iter().zip(names).map(|((lat, lon), name)| format!("{name},{lat},{lon}\n"));
        let rows = rows.collect::<String>();
        for (column, n_routes) in [("name", n_routes), ("id", 1)] {
            let file = format!("{column},lat,lon\n{rows}");
            assert_eq!(read(file.as_bytes()).expect(&file).len(), n_routes, "{file}");
        }
    }
    let file = "route,lat,lon\na,1,2\nb,1,3\n";
    assert_eq!(read(file.as_bytes()).expect(file).len(), 2);
}

#[test]
fn blanks_beside_commas_of_kml_do_not_end_a_tuple() {
    let expected = only(&kml());
    for separator in [", ", " ,", " , ", ",  "] {
        let line = list(|lat, lon| format!("{lon}{separator}{lat}{separator}-5"), " ");
        let (before, rest) =
            kml().split_once("coordinates>").map(|(a, b)| (a.to_owned(), b.to_owned())).expect("has some");
        let (_, after) = rest.split_once("</").expect("ends");
        assert_eq!(only(&format!("{before}coordinates>{line}</{after}")), expected, "{separator:?}");
    }
    let error = read(kml().replace("-9.2,38.7,-5 ", "-9.2,38.7,-5, ").as_bytes()).expect_err("runs on");
    assert!(error.fault.contains("longitude,latitude"), "{error}");
}

#[test]
fn properties_of_geojson_points_are_used_or_named() {
    let points = |properties: &str| {
        let each = |lat, lon| {
            format!(
                r#"{{"type":"Feature","properties":{properties},"geometry":{{"type":"Point","coordinates":[{lon},{lat}]}}}}"#
            )
        };
        format!(r#"{{"type":"FeatureCollection","features":[{}]}}"#, list(each, ","))
    };
    let route = only(&points(r#"{"name":"WP","speed_mps":1.5,"depth_m":"4","stroke":"red","fill":null}"#));
    let stated = |point: &crate::RoutePoint| (point.speed_mps, point.depth_m) == (Some(1.5), Some(4.0));
    assert!(route.points.len() == 3 && route.points.iter().all(stated), "{route:?}");
    assert_eq!(route.left_out(), ["properties that are not used: stroke"]);
    let line = geojson("LineString", "[", "]").replace(r#""name":"a""#, r#""name":"a","speed":2"#);
    assert_eq!(only(&line).left_out(), ["properties that are not used: speed"]);
    let hole = r#"{"type":"Polygon","coordinates":[[[0,0],[1,0],[1,1],[0,0]],[[0.5,0.2],[0.6,0.2],[0.6,0.3],[0.5,0.2]]]}"#;
    assert_eq!(only(hole).left_out(), ["holes of the area, which are left out"]);
    let error = read(points(r#"{"speed_mps":"slow"}"#).as_bytes()).expect_err("is a word");
    assert_eq!(error.to_string(), "line 1 (/features/0/properties/speed_mps): \"slow\" is no number");
}

#[test]
fn errors_name_the_place_that_cannot_be_read() {
    for (file, place, fault) in [
        (kml().replace("38.701,", "98.701,"), "line 2", "not on Earth"),
        (kml().replace("</Document>", ""), "line 3", "is no XML"),
        (geojson("LineString", "[", ",[1]]"), "line 1 (/features/0/geometry/coordinates/3)", "latitude"),
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
        assert!(error.place == place && error.fault.contains(fault), "{error} of {file}");
    }
    let two = format!("<gpx>{}{}</gpx>", gpx("rte", "rtept"), gpx("rte", "rtept"));
    assert!(select(read(two.as_bytes()).expect("is GPX"), None).is_err());
}

#[test]
fn files_that_expand_or_nest_too_far_are_refused() {
    let bomb = kmz(&vec![b' '; BYTES_MAX + 1]);
    assert!(read(&bomb).expect_err("is large").fault.contains("unpacked"));
    let lol = "<!DOCTYPE l [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;&a;&a;\">]>";
    let entities = kml().replace("<kml", &format!("{lol}<kml")).replace("a &amp; b", "&b;");
    assert_eq!(read(entities.as_bytes()).expect("is KML")[0].name, "");
    assert!(read("<a>".repeat(1_000_000).as_bytes()).is_err());
    assert!(read("[".repeat(1_000_000).as_bytes()).is_err());
}

/// The most expensive files of each kind: many of the shortest pieces that are kept or skipped,
/// between a beginning and an end. The last two are as large as is read.
const DEAR: [&str; 28] = [
    "points=0,0\n|points=\n|",
    "|points=0,0\n|",
    "pts={|0,0:|}",
    "|format=lawnmower,x=0,y=0,width=1,height=1e5,lane_width=1\n|",
    "QGC WPL 110\n|0 0 0 16 0 0 0 0 1 1 0 0\n|",
    "QGC WPL 110\n|0 0 0 178 0 1 0 0 0 0 0 0\n|",
    "QGC WPL 110\n|1 0 0 16 0 0 0 0 1 1 0 0\n9 0 0 177 1 9 0 0 0 0 0 0\n|",
    "|behavior=\nrepeat=9\npts=0,0\n}\n|",
    "QGC WPL 110\n|0 |",
    "lat,lon|,|\n1,1",
    "lat,lon\n1,1|,|",
    "lat,lon,name\n|1,1,a\n1,1,\n|",
    "[|NESTED,|0]",
    "[|{},|0]",
    "{|\"\":0,|\"\":0}",
    "{\"type\":\"LineString\",\"coordinates\":[|[1,1],|[1,1]]}",
    "[\"|\\n|\"]",
    "{\"type\":\"Feature\",\"geometry\":null,\"properties\":{|\"a\":1,|\"a\":1}}",
    "<kml><Placemark><coordinates>|1,1 |</coordinates></Placemark></kml>",
    "<Placemark><coordinates>|1, |</coordinates></Placemark>",
    "<Placemark><coordinates>|1,|</coordinates></Placemark>",
    "<trk>|<trkpt lat='1' lon='1'/>|</trk>",
    "<gpx>|<rte><rtept lat='1' lon='1'/></rte>|</gpx>",
    "<gpx><wpt lat='1' |a='' |lon='1'/></gpx>",
    "<gpx>|<a/>|</gpx>",
    "<gpx>|\n|</gpx>",
    "170000{\"type\":\"LineString\",\"coordinates\":[|[1,1],|[1,1]]}",
    "50000[|{},|0]",
];

/// The files of [`DEAR`] with so many bytes.
fn dear(bytes: usize) -> impl Iterator<Item = (&'static str, String)> {
    DEAR.into_iter().map(move |kind| {
        let parts: Vec<&str> = kind.split('|').collect();
        let [before, piece, after] = parts[..] else { panic!("{kind}") };
        let start = before.trim_start_matches(|digit: char| digit.is_ascii_digit());
        let piece = piece.replace("NESTED", &format!("{}{}", "[".repeat(100), "]".repeat(100)));
        let n = before[..before.len() - start.len()].parse();
        let n = n.unwrap_or_else(|_| (bytes - before.len() - after.len()) / piece.len());
        (kind, format!("{start}{}{after}", piece.repeat(n)))
    })
}

#[test]
fn no_file_takes_more_than_eight_times_the_memory_of_the_largest() {
    for (kind, file) in dear(BYTES_MAX) {
        let file = kmz(file.as_bytes());
        let taken = allocation_counter::measure(|| drop(read(&file)));
        let mib = taken.bytes_max >> 20;
        println!("{kind:?}: {mib} MiB for {} bytes", file.len());
        assert!(mib <= 64, "{kind:?}: {mib} MiB");
    }
}

#[test]
fn reading_ends_once_it_is_due() {
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
            assert!(whole == 0 || (looks <= due_at + 5 && error.is_some()), "{kind:?}: {looks} of {whole}");
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
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
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

#[test]
fn areas_are_the_polygons_of_a_file_with_their_holes_and_what_is_none_is_an_error() {
    let ring = |side: f64| format!("[[-9,38],[-9,{}],[{},38],[-9,38]]", 38.0 + side, -9.0 + side);
    let (border, hole) = (ring(0.1), ring(0.01));
    let feature = |geometry: &str| {
        format!(r#"{{"type":"Feature","properties":{{"name":"a"}},"geometry":{{"type":{geometry}}}}}"#)
    };
    let file = |features: &str| format!(r#"{{"type":"FeatureCollection","features":[{features}]}}"#);
    let polygon = feature(&format!(r#""Polygon","coordinates":[{border},{hole}]"#));
    let many = feature(&format!(r#""MultiPolygon","coordinates":[[{border}],[{hole}]]"#));
    let areas = crate::areas(file(&format!("{polygon},{many}")).as_bytes()).expect("three areas");
    let corners = |area: &crate::Area| area.rings.iter().map(Vec::len).collect::<Vec<_>>();
    assert_eq!(areas.iter().map(corners).collect::<Vec<_>>(), [vec![3, 3], vec![3], vec![3]]);
    assert!(areas.iter().all(|area| area.name == "a"));
    let tip = crate::Place::Earth { lat_deg: 38.1, lon_deg: -9.0 };
    assert_eq!(areas[0].rings[0][1].place, tip);
    for (features, fault) in [
        (feature(r#""Point","coordinates":[-9,38]"#), "line 1 (/features/0/geometry): is no polygon"),
        (polygon.replace("38.1", "98.1"), "is not on Earth"),
        ("7".to_owned(), "is neither GeoJSON"),
    ] {
        let error = crate::areas(file(&features).as_bytes()).expect_err(fault).to_string();
        assert!(error.contains(fault), "{error}");
    }
}
