"""The client with asyncio. The other tests use client.py, which is generated from it."""

import asyncio
import time

import pytest
from conftest import Service
from live import LIVE, heard
from test_missions import OUTAGE_S

from pilotfish import AsyncClient, Refused


def test_plans(url):
    async def main():
        async with AsyncClient(url) as client:
            snapshot = await client.example("track")
            plans = await asyncio.gather(*(client.plan(snapshot) for _ in range(4)))
            assert [plan["outcome"] for plan in plans] == ["ok"] * 4
            assert "mpc" in (await client.compare(snapshot)).plans
            snapshot["asc"]["heading_rad"] = 19.0
            with pytest.raises(Refused, match="/asc/heading_rad"):
                await client.plan(snapshot)
            assert isinstance((await client.plan_batch([snapshot]))[0], Refused)

    asyncio.run(main())


def test_a_simulated_mission_becomes_a_table_and_a_file(url, tmp_path):
    async def main():
        async with AsyncClient(url) as client, client.simulate("paper-tracking") as mission:
            await mission.step(5)
            assert len((await mission.frame()).query("kind == 'planned'")) == 5
            saved = await mission.save(tmp_path / "mission.mcap")
            assert saved.read_bytes().startswith(b"\x89MCAP")
            assert mission.id in [each["id"] async for each in client.missions()]
        async with AsyncClient(url) as client:
            assert (await client.mission(mission.id).look())["status"] == "finished"

    asyncio.run(main())


@pytest.mark.soak
def test_a_mission_is_finished_when_its_task_is_cancelled(url):
    async def main():
        async with AsyncClient(url) as client:
            mission = await client.create_mission(live=LIVE)

            async def waits():
                async with mission:
                    await mission.run()
                    await mission.wait()

            with pytest.raises(TimeoutError):
                await asyncio.wait_for(waits(), 0.5)
            assert (await mission.look())["status"] == "finished"

    asyncio.run(main())


@pytest.mark.soak
def test_a_killed_service_costs_no_event_and_no_report(own_service: Service):
    async def watch(mission):
        return [event async for event in mission.events()]

    async def main():
        async with AsyncClient(own_service.url) as client, client.create_mission(live=LIVE) as mission:
            watcher = asyncio.create_task(watch(mission))
            await mission.run()
            accepted = []
            for post in range(20):
                if post == 10:
                    own_service.kill()
                    asyncio.get_running_loop().call_later(OUTAGE_S, own_service.start)
                accepted.append((await mission.report(**heard()))["sequence"])
                await asyncio.sleep(0.1)
            reference = await mission.reference(wait_s=5)
            assert reference["plan"]["reference"]["valid_until_s"] > time.time()
            last = (await mission.finish())["sequence"]
            seen = await asyncio.wait_for(watcher, 30)
        assert [event.sequence for event in seen] == list(range(1, last + 1))
        assert [event.sequence for event in seen if event.kind == "reported"] == accepted

    asyncio.run(main())
