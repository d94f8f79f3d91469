"""The client with asyncio. The other tests use client.py, which is generated from it."""

import asyncio

import pytest
from live import LIVE

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
