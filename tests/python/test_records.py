"""Records, opened with what people open them with: pandas, GeoPandas, the MCAP reader.

PILOTFISH is the path of the program. Every format is of the same mission, so that each can be compared
with the table.
"""

import json
import math
import subprocess
import sys
from pathlib import Path

import geopandas
import jsonschema
import mcap.reader
import numpy as np
import pandas as pd
import pyarrow.parquet
import pytest
from scipy.spatial.transform import Rotation

from program import program, read, rows_of

DRAW = Path(__file__).resolve().parents[2] / "examples" / "draw.py"
SCENARIO = "paper-tracking"
SEED = 5
VEHICLES = ["asc", "auv-1"]
FORMATS = ["csv", "parquet", "geojson", "mcap", "ndjson"]

# The datum of the built-in scenarios, and metres east and north of it by a projection of PROJ's own.
ORIGIN = "+lat_0=38.41 +lon_0=-9.12"
LOCAL = f"+proj=aeqd {ORIGIN} +ellps=WGS84 +units=m"

# The map has nine decimals of a degree: 5.6e-5 m is half of the last one, and all that is measured.
MAP_TOLERANCE_M = 1e-4


@pytest.fixture(scope="session")
def files(tmp_path_factory):
    """The paths of the files, by format."""
    folder = tmp_path_factory.mktemp("records")
    paths = {kind: folder / f"record.{kind}" for kind in FORMATS}
    command = [program(), "simulate", SCENARIO, "--controller", "saturated_los"]
    command += ["--seed", str(SEED)]
    for path in paths.values():
        command += ["--out", str(path)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return paths


@pytest.fixture(scope="session")
def table(files):
    return read(files["csv"])


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
    return rows_of(table, "truth", vehicle)[["east_m", "north_m"]].to_numpy()


def lines(path):
    """The table from its lines of JSON: absent members are what is not known."""
    with open(path) as file:
        return pd.DataFrame([json.loads(line) for line in file])


def assert_same_table(one, other):
    """The same cells, to the bit; columns of which nothing is known may be missing."""
    one, other = (table.dropna(axis="columns", how="all") for table in (one, other))
    assert set(one.columns) == set(other.columns)
    for name in one.columns:
        cells = [table[name].astype(object).where(table[name].notna(), None) for table in (one, other)]
        assert cells[0].tolist() == cells[1].tolist(), name


def test_parquet_and_lines_of_json_have_the_table_of_the_csv_to_the_bit(files, table):
    parquet = pd.read_parquet(files["parquet"])
    assert list(parquet.columns) == list(table.columns)
    assert len(parquet) == len(table) > 5 * 1000
    assert_same_table(parquet, table)
    assert_same_table(lines(files["ndjson"]), table)


def test_an_instant_is_a_plan_the_truth_and_what_was_known(table):
    rows = table.groupby(["kind", "vehicle"], dropna=False)["t_s"].agg(list)
    times = rows_of(table, "planned")["t_s"].tolist()
    assert times == list(range(len(times)))
    expected = [(kind, vehicle) for kind in ("known", "truth") for vehicle in VEHICLES]
    assert [key for key in rows.index if key[0] != "planned"] == expected
    assert all(rows[key] == times for key in expected)


def test_what_is_never_known_is_null_in_parquet(files):
    # Line of sight predicts nothing; how long it took is recorded.
    parquet = pd.read_parquet(files["parquet"])
    assert parquet["predicted_rms_m"].dtype == np.float64
    assert parquet["predicted_rms_m"].isna().all()
    assert (rows_of(parquet, "planned")["solve_ms"] >= 0.0).all()


def test_parquet_says_what_it_is_of(files):
    pairs = pyarrow.parquet.read_schema(files["parquet"]).metadata
    assert pairs[b"scenario"] == SCENARIO.encode()
    assert pairs[b"seed"] == str(SEED).encode()
    assert pairs[b"schema_version"] == b"3"
    assert float(pairs[b"interval_s"]) == 1.0
    assert {b"title", b"guide"} <= pairs.keys()
    columns = pyarrow.parquet.read_metadata(files["parquet"]).row_group(0)
    assert {columns.column(i).compression for i in range(columns.num_columns)} == {"SNAPPY"}


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


def test_tracks_on_the_map_are_where_another_projection_puts_the_table(places, table):
    metres = places.to_crs(LOCAL)
    for kind, vehicle in (("asc", "asc"), ("auv", "auv-1")):
        on_map = np.array(metres.loc[(kind, vehicle)].geometry.coords)[:, :2]
        assert np.abs(on_map - track(table, vehicle)).max() < MAP_TOLERANCE_M


def test_each_point_of_a_track_has_its_time_and_its_depth(places, table):
    row = places.loc[("auv", "auv-1")]
    times = np.array(json.loads(row["t_s"]) if isinstance(row["t_s"], str) else row["t_s"])
    truths = rows_of(table, "truth", "auv-1")
    assert times == pytest.approx(truths["t_s"].to_numpy())
    altitudes = np.array(row.geometry.coords)[:, 2]
    # Altitudes have three decimals.
    assert altitudes == pytest.approx(-truths["depth_m"].to_numpy(), abs=0.6e-3)


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
    instants = table["t_s"].nunique()
    expected = {
        "/rows": ("pilotfish.Row", len(table)),
        "/tf": ("foxglove.FrameTransforms", len(VEHICLES) * instants),
        "/scene": ("foxglove.SceneUpdate", 1),
    }
    for vehicle in VEHICLES:
        expected[f"/{vehicle}/pose"] = ("foxglove.PoseInFrame", instants)
        expected[f"/{vehicle}/fix"] = ("foxglove.LocationFix", instants)
    assert {topic: (schemas[topic][0], len(of)) for topic, of in messages.items()} == expected


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
    for vehicle in VEHICLES:
        poses, truths = log[1][f"/{vehicle}/pose"], rows_of(table, "truth", vehicle)
        for i in (0, len(truths) // 3, len(truths) - 1):
            row, (log_time, message) = truths.iloc[i], poses[i]
            assert log_time == round(row["t_s"] * 1e9)
            timestamp = message["timestamp"]
            assert timestamp["sec"] * 10**9 + timestamp["nsec"] == log_time
            position = [message["pose"]["position"][axis] for axis in "xyz"]
            assert position == [row["east_m"], row["north_m"], -row["depth_m"]]
            # Where the bow points, from heading and pitch alone.
            heading = row["heading_rad"]
            pitch = 0.0 if vehicle == "asc" else row["pitch_rad"]
            bow = [
                math.cos(pitch) * math.sin(heading),
                math.cos(pitch) * math.cos(heading),
                math.sin(pitch),
            ]
            turn = Rotation.from_quat([message["pose"]["orientation"][axis] for axis in "xyzw"])
            assert turn.apply([1.0, 0.0, 0.0]) == pytest.approx(bow, abs=1e-12)
            # Port stays level: nothing rolls.
            assert turn.apply([0.0, 1.0, 0.0])[2] == pytest.approx(0.0, abs=1e-12)


def test_transforms_and_poses_agree(log):
    _, messages = log
    for i, (_, message) in enumerate(messages["/tf"]):
        (transform,) = message["transforms"]
        vehicle = VEHICLES[i % len(VEHICLES)]
        pose = messages[f"/{vehicle}/pose"][i // len(VEHICLES)][1]["pose"]
        assert (transform["parent_frame_id"], transform["child_frame_id"]) == ("world", vehicle)
        assert transform["translation"] == pose["position"]
        assert transform["rotation"] == pose["orientation"]


def test_fixes_lie_on_the_tracks_of_the_map(log, places):
    for kind, vehicle in (("asc", "asc"), ("auv", "auv-1")):
        on_map = np.array(places.loc[(kind, vehicle)].geometry.coords)[:, :2]
        fixes = log[1][f"/{vehicle}/fix"]
        logged = np.array([[fix["longitude"], fix["latitude"]] for _, fix in fixes])
        # The map has nine decimals.
        assert np.abs(on_map - logged).max() < 0.6e-9


def test_the_rows_of_the_log_are_those_of_the_table(log, table):
    assert_same_table(pd.DataFrame([row for _, row in log[1]["/rows"]]), table)


def test_a_mission_without_a_surface_craft_leaves_in_every_format(tmp_path):
    paths = {kind: tmp_path / f"record.{kind}" for kind in FORMATS}
    command = [program(), "simulate", "paper-path-following"]
    for path in paths.values():
        command += ["--out", str(path)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    table = read(paths["csv"])
    assert_same_table(pd.read_parquet(paths["parquet"]), table)
    assert_same_table(lines(paths["ndjson"]), table)
    assert (set(table["kind"]), set(table["vehicle"])) == ({"truth"}, {"auv-1"})
    assert set(geopandas.read_file(paths["geojson"])["kind"]) == {"auv", "path"}
    with open(paths["mcap"], "rb") as stream:
        summary = mcap.reader.make_reader(stream).get_summary()
    topics = {channel.topic for channel in summary.channels.values()}
    assert topics == {"/tf", "/rows", "/scene", "/auv-1/pose", "/auv-1/fix"}


def test_a_simulated_fleet_is_drawn(tmp_path):
    record, picture = tmp_path / "fleet.csv", tmp_path / "fleet.svg"
    command = [program(), "simulate", "fleet-survey", "--duration-s", "10", "--out", record]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    for what, names in (
        (["tracks"], ["asc-1", "asc-2", "auv-4"]),
        (["time", "goal_distance_m"], ["asc-1", "asc-2"]),
        (["ages"], ["auv-1", "auv-4"]),
    ):
        subprocess.run([sys.executable, DRAW, *what, record, "--out", picture], check=True, stdout=subprocess.DEVNULL)
        assert all(f">{name}<" in picture.read_text(encoding="utf-8") for name in names), what
