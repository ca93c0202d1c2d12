"""A bare socket server, the lower bound for the cost of sending an answer.

`python -m harness.bare ADDRESS BYTES` answers every request with BYTES bytes, written from one buffer. It
runs in a separate process, so that the client is the same as for a real server.
"""

import socket
import sys


def main() -> None:
    port, n_bytes = int(sys.argv[1].rpartition(":")[2]), int(sys.argv[2])
    content = b"\1" * n_bytes
    with socket.create_server(("127.0.0.1", port)) as listener:
        while True:
            connection, _ = listener.accept()
            with connection:
                answer(connection, content)


def answer(connection: socket.socket, content: bytes) -> None:
    """Serves one keep-alive connection. Requests must have no body."""
    pending = b""
    while received := connection.recv(1 << 16):
        pending += received
        if not pending.endswith(b"\r\n\r\n"):
            continue
        body = b"" if b"/health/ready" in pending else content
        connection.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(body))
        connection.sendall(body)
        pending = b""


if __name__ == "__main__":
    main()
