#!/usr/bin/env python3
"""Passes TCP connections on, and what comes back later: a network with latency, for benchmarks.

usage: delay_proxy.py TARGET_PORT MILLISECONDS

Listens on the loopback, prints "port N", and forwards to TARGET_PORT there. Bytes of the answer arrive the
given time after they were sent; as many may be under way as there are.
"""
import asyncio
import sys


async def forward(reader, writer, delay):
    """Copies until the end; bytes wait in a queue until they are due."""
    loop = asyncio.get_running_loop()
    queue = asyncio.Queue()

    async def deliver():
        while True:
            due, data = await queue.get()
            await asyncio.sleep(max(0, due - loop.time()))
            if not data:
                writer.close()
                return
            writer.write(data)
            await writer.drain()

    delivering = asyncio.create_task(deliver())
    try:
        while data := await reader.read(65536):
            queue.put_nowait((loop.time() + delay, data))
    except ConnectionError:
        pass
    queue.put_nowait((loop.time() + delay, b""))
    await asyncio.gather(delivering, return_exceptions=True)


async def main():
    target, delay = int(sys.argv[1]), float(sys.argv[2]) / 1000

    async def accept(reader, writer):
        back, there = await asyncio.open_connection("127.0.0.1", target)
        await asyncio.gather(forward(reader, there, 0), forward(back, writer, delay))

    server = await asyncio.start_server(accept, "127.0.0.1", 0)
    print("port", server.sockets[0].getsockname()[1], flush=True)
    async with server:
        await server.serve_forever()


asyncio.run(main())
