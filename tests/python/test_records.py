"""Records, opened with what people open them with: pandas, GeoPandas, the MCAP reader.

PILOTFISH is the path of the program. Every format is of the same mission, so that each can be compared
with the CSV.
"""

import json
import math
import subprocess

import geopandas
import jsonschema
import mcap.reader
import numpy as np
import pandas as pd
import pyarrow.parquet
import pytest
from scipy.spatial.transform import Rotation

from program import program

SCENARIO = "paper-tracking"
SEED = 5
VEHICLES = {"asc": "asc", "auv-1": "auv_1"}

# The datum of the built-in scenarios, and metres east and north of it by a projection of PROJ's own.
ORIGIN = "+lat_0=38.41 +lon_0=-9.12"
LOCAL = f"+proj=aeqd {ORIGIN} +ellps=WGS84 +units=m"

# The map has nine decimals of a degree: 5.6e-5 m is half of the last one, and all that is measured.
MAP_TOLERANCE_M = 1e-4

# The CSV has six decimals.
CSV_TOLERANCE = 0.5000001e-6


@pytest.fixture(scope="session")
def files(tmp_path_factory):
    """The paths of the four files, by format."""
    folder = tmp_path_factory.mktemp("records")
    paths = {kind: folder / f"record.{kind}" for kind in ("csv", "parquet", "geojson", "mcap")}
    command = [program(), "simulate", SCENARIO, "--controller", "saturated_los"]
    command += ["--seed", str(SEED)]
    for path in paths.values():
        command += ["--out", str(path)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return paths


@pytest.fixture(scope="session")
def table(files):
    return pd.read_csv(files["csv"])


@pytest.fixture(scope="session")
def places(files):
    return geopandas.read_file(files["geojson"]).set_index(["kind", "id"])


@pytest.fixture(scope="session")
def log(files):
    """Schemas by topic, and (time in ns, message) in order by topic."""
    schemas, messages = {}, {}
    with open(files["mcap"], "rb") as stream:
        reader = mcap.reader.make_reader(stream, validate_crcs=True)
        for schema, channel, message in reader.iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            schemas[channel.topic] = (schema.name, json.loads(schema.data))
            body = json.loads(message.data)
            messages.setdefault(channel.topic, []).append((message.log_time, body))
    return schemas, messages


def track(table, vehicle):
    """East and north, m."""
    column = VEHICLES[vehicle]
    return table[[f"{column}_east_m", f"{column}_north_m"]].to_numpy()


def length(points):
    return np.linalg.norm(np.diff(points, axis=0), axis=1).sum()


def test_parquet_has_the_columns_and_values_of_the_csv(files, table):
    parquet = pd.read_parquet(files["parquet"])
    assert list(parquet.columns) == list(table.columns)
    assert len(parquet) == len(table) > 1000
    for name in table.columns:
        if name == "method":
            assert (parquet[name] == table[name]).all()
            continue
        assert parquet[name].dtype == np.float64, name
        # Where there was nothing to tell, both are NaN.
        assert (parquet[name].isna() == table[name].isna()).all(), name
        difference = (parquet[name] - table[name]).abs().max()
        assert not CSV_TOLERANCE < difference, name


def test_what_is_never_told_is_null_in_parquet(files):
    # Line of sight predicts nothing; how long it took is told.
    parquet = pd.read_parquet(files["parquet"])
    assert parquet["predicted_rms_m"].isna().all()
    assert (parquet["solve_ms"] >= 0.0).all()


def test_parquet_says_what_it_is_of(files):
    pairs = pyarrow.parquet.read_schema(files["parquet"]).metadata
    assert pairs[b"scenario"] == SCENARIO.encode()
    assert pairs[b"seed"] == str(SEED).encode()
    assert pairs[b"schema_version"] == b"1"
    assert float(pairs[b"interval_s"]) == 1.0
    assert {b"title", b"guide"} <= pairs.keys()


def test_the_map_is_in_wgs_84_with_a_line_for_each_track(places):
    # With altitudes, readers call it EPSG:4979: the same with a third axis.
    assert places.crs.to_2d().to_epsg() == 4326
    kinds = {"LineString": {"asc", "auv", "goal", "path"}, "Polygon": {"keep_out", "area"}}
    for (kind, _), row in places.iterrows():
        assert kind in kinds[row.geometry.geom_type]
        assert row.geometry.is_valid
        assert (row["scenario"], row["seed"]) == (SCENARIO, SEED)
    assert set(places.index) == {("asc", "asc"), ("auv", "auv-1"), ("goal", "goal"), ("path", "auv-1")}
    assert places.loc[("auv", "auv-1")].geometry.has_z
    assert not places.loc[("asc", "asc")].geometry.has_z


def test_tracks_on_the_map_are_as_long_as_in_the_table(places, table):
    metres = places.to_crs(places.estimate_utm_crs())
    for kind, vehicle in (("asc", "asc"), ("auv", "auv-1")):
        on_map = metres.loc[(kind, vehicle)].geometry.length
        # UTM's scale is within 4e-4 of 1 in most of a zone and 1e-3 everywhere in it.
        assert on_map == pytest.approx(length(track(table, vehicle)), rel=1e-3)


def test_tracks_on_the_map_are_where_another_projection_puts_the_table(places, table):
    metres = places.to_crs(LOCAL)
    for kind, vehicle in (("asc", "asc"), ("auv", "auv-1")):
        on_map = np.array(metres.loc[(kind, vehicle)].geometry.coords)[:, :2]
        assert np.abs(on_map - track(table, vehicle)).max() < MAP_TOLERANCE_M


def test_each_point_of_a_track_has_its_time_and_its_depth(places, table):
    row = places.loc[("auv", "auv-1")]
    times = np.array(json.loads(row["t_s"]) if isinstance(row["t_s"], str) else row["t_s"])
    assert times == pytest.approx(table["t_s"].to_numpy())
    altitudes = np.array(row.geometry.coords)[:, 2]
    # Altitudes have three decimals.
    assert altitudes == pytest.approx(-table["auv_1_depth_m"].to_numpy(), abs=0.6e-3)


def test_paths_discs_and_area_of_a_scenario_are_on_the_map_at_their_size(tmp_path):
    path = tmp_path / "crowded.geojson"
    command = [program(), "simulate", "crowded", "--controller", "saturated_los"]
    subprocess.run(command + ["--out", str(path)], check=True, stdout=subprocess.DEVNULL)
    places = geopandas.read_file(path).set_index(["kind", "id"])
    assert places.geometry.is_valid.all()
    vehicles = {"auv-1", "auv-2"}
    kinds = {"asc": {"asc"}, "auv": vehicles, "goal": {"goal"}, "path": vehicles}
    kinds |= {"keep_out": {"keep-out-1"}, "area": {"area"}}
    assert set(places.index) == {(kind, id) for kind, ids in kinds.items() for id in ids}
    metres = places.to_crs(LOCAL).geometry

    # Four lanes of 100 m and three half circles of 20 m across, drawn as chords: 1e-4 short of that. Lanes
    # begin at (0, 0) and, for the second vehicle, 60 m east; the fourth comes back, 60 m further east.
    for vehicle, east in (("auv-1", 0.0), ("auv-2", 60.0)):
        line = metres["path", vehicle]
        assert line.length == pytest.approx(400.0 + 30.0 * math.pi, rel=3e-4)
        ends = np.array([line.coords[0], line.coords[-1]])
        assert ends == pytest.approx(np.array([[east, 0.0], [east + 60.0, 0.0]]), abs=MAP_TOLERANCE_M)
        # The northernmost point is that of a turn.
        assert line.bounds[3] == pytest.approx(110.0, abs=0.02)

    # A polygon of 64 corners, which is 0.16 % smaller than its circle.
    disc = metres["keep_out", "keep-out-1"]
    assert disc.area == pytest.approx(32.0 * 8.0**2 * math.sin(math.tau / 64.0), rel=1e-4)
    assert [disc.centroid.x, disc.centroid.y] == pytest.approx([50.0, 60.0], abs=MAP_TOLERANCE_M)
    area = metres["area", "area"]
    assert area.bounds == pytest.approx((-60.0, -60.0, 180.0, 160.0), abs=MAP_TOLERANCE_M)
    assert area.area == pytest.approx(240.0 * 220.0, rel=1e-5)


def test_every_topic_has_its_schema_and_a_message_a_row(log, table):
    schemas, messages = log
    expected = {"/tf": "foxglove.FrameTransforms", "/tick": "pilotfish.Tick"}
    for vehicle in VEHICLES:
        expected[f"/{vehicle}/pose"] = "foxglove.PoseInFrame"
        expected[f"/{vehicle}/fix"] = "foxglove.LocationFix"
    for topic, name in expected.items():
        assert schemas[topic][0] == name
        assert len(messages[topic]) == len(table), topic
    assert schemas["/scene"][0] == "foxglove.SceneUpdate"
    assert len(messages["/scene"]) == 1
    assert schemas.keys() == expected.keys() | {"/scene"}


def test_the_log_has_statistics_an_index_and_what_it_is_of(files, log):
    with open(files["mcap"], "rb") as stream:
        reader = mcap.reader.make_reader(stream)
        summary = reader.get_summary()
        assert summary.statistics.message_count == sum(map(len, log[1].values()))
        assert summary.chunk_indexes
        (about,) = reader.iter_metadata()
        assert about.metadata["scenario"] == SCENARIO


def test_every_message_keeps_to_its_schema(log):
    schemas, messages = log
    for topic, (_, schema) in schemas.items():
        validator = jsonschema.Draft202012Validator(schema)
        for _, message in messages[topic][:: max(1, len(messages[topic]) // 50)]:
            validator.validate(message)
            # Beyond the schema, which would let them pass.
            assert message.keys() <= schema["properties"].keys(), topic


def test_poses_are_the_table_turned_to_east_north_up(log, table):
    for vehicle, column in VEHICLES.items():
        poses = log[1][f"/{vehicle}/pose"]
        for i in (0, len(table) // 3, len(table) - 1):
            row, (log_time, message) = table.iloc[i], poses[i]
            assert log_time == round(row["t_s"] * 1e9)
            timestamp = message["timestamp"]
            assert timestamp["sec"] * 10**9 + timestamp["nsec"] == log_time
            depth = row.get(f"{column}_depth_m", 0.0)
            position = [message["pose"]["position"][axis] for axis in "xyz"]
            expected = [row[f"{column}_east_m"], row[f"{column}_north_m"], -depth]
            assert position == pytest.approx(expected, abs=CSV_TOLERANCE)
            # Where the bow points, from heading and pitch alone.
            heading, pitch = row[f"{column}_heading_rad"], row.get(f"{column}_pitch_rad", 0.0)
            bow = [
                math.cos(pitch) * math.sin(heading),
                math.cos(pitch) * math.cos(heading),
                math.sin(pitch),
            ]
            turn = Rotation.from_quat([message["pose"]["orientation"][axis] for axis in "xyzw"])
            assert turn.apply([1.0, 0.0, 0.0]) == pytest.approx(bow, abs=2e-6)
            # Port stays level: nothing rolls.
            assert turn.apply([0.0, 1.0, 0.0])[2] == pytest.approx(0.0, abs=1e-12)


def test_transforms_and_poses_agree(log):
    _, messages = log
    for i, (_, message) in enumerate(messages["/tf"]):
        assert [transform["child_frame_id"] for transform in message["transforms"]] == list(VEHICLES)
        for transform in message["transforms"]:
            pose = messages[f"/{transform['child_frame_id']}/pose"][i][1]["pose"]
            assert transform["parent_frame_id"] == "world"
            assert transform["translation"] == pose["position"]
            assert transform["rotation"] == pose["orientation"]


def test_fixes_lie_on_the_tracks_of_the_map(log, places):
    for kind, vehicle in (("asc", "asc"), ("auv", "auv-1")):
        on_map = np.array(places.loc[(kind, vehicle)].geometry.coords)[:, :2]
        fixes = log[1][f"/{vehicle}/fix"]
        logged = np.array([[fix["longitude"], fix["latitude"]] for _, fix in fixes])
        # The map has nine decimals.
        assert np.abs(on_map - logged).max() < 0.6e-9


def test_ticks_are_the_rows_of_the_table(log, table):
    for i, (_, tick) in enumerate(log[1]["/tick"][:: len(table) // 20]):
        row = table.iloc[i * (len(table) // 20)].dropna()
        assert tick.keys() == set(row.index)
        for name, value in row.items():
            if isinstance(value, str):
                assert tick[name] == value
            else:
                assert tick[name] == pytest.approx(value, abs=CSV_TOLERANCE), name


def test_a_mission_without_a_surface_craft_leaves_in_every_format(tmp_path):
    paths = [tmp_path / f"record.{kind}" for kind in ("csv", "parquet", "geojson", "mcap")]
    command = [program(), "simulate", "paper-path-following"]
    for path in paths:
        command += ["--out", str(path)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    parquet = pd.read_parquet(paths[1])
    assert list(parquet.columns) == list(pd.read_csv(paths[0]).columns)
    assert not any(name.startswith("asc_") for name in parquet.columns)
    assert set(geopandas.read_file(paths[2])["kind"]) == {"auv", "path"}
    with open(paths[3], "rb") as stream:
        summary = mcap.reader.make_reader(stream).get_summary()
    topics = {channel.topic for channel in summary.channels.values()}
    assert topics == {"/tf", "/tick", "/scene", "/auv-1/pose", "/auv-1/fix"}
