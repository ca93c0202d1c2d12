# The service as a small image:
#
#     docker build -t gramian .
#     docker run --rm -p 8080:8080 -e GRAMIAN_ALLOW_ANONYMOUS=1 gramian
#
# It listens beyond its own machine, so it starts only with keys (GRAMIAN_KEYS_FILE, GRAMIAN_API_KEYS) or with
# that permission. tests/image.sh builds and runs it where there is no container engine.

FROM rust:1.95-bookworm AS build
WORKDIR /src
COPY . .
# The caches outlive a build, and cargo tells fresh from stale by modification time: the touch keeps an older
# checkout from being answered with the binary of a newer one. Cargo's own lock files lie outside the mounts,
# hence `locked`. Line tables serve debuggers and profilers, not the image; stripping without generating them
# saves compile time.
RUN --mount=type=cache,id=gramian-registry,target=/usr/local/cargo/registry,sharing=locked \
    --mount=type=cache,id=gramian-target,target=/target,sharing=locked \
    touch src/lib.rs src/main.rs host/src/lib.rs numerics/src/lib.rs observer/src/lib.rs \
    && CARGO_TARGET_DIR=/target CARGO_PROFILE_RELEASE_DEBUG=false CARGO_PROFILE_RELEASE_STRIP=symbols \
       cargo build --release --locked --all-features --bin gramian \
    && install /target/release/gramian /usr/local/bin/gramian \
    && mkdir /store

FROM debian:bookworm-slim
LABEL org.opencontainers.image.title="gramian" \
      org.opencontainers.image.description="Geometric kernel interpolation and regression on point clouds, served over HTTP" \
      org.opencontainers.image.licenses="MIT OR Apache-2.0"
COPY --from=build /usr/local/bin/gramian /usr/local/bin/gramian
# Whom a bucket's server is certified by.
COPY --from=build /etc/ssl/certs/ca-certificates.crt /etc/ssl/certs/ca-certificates.crt
# A volume that is mounted here belongs to the user of the image: GRAMIAN_STORE=/var/lib/gramian.
COPY --from=build --chown=10001:10001 /store /var/lib/gramian
ENV GRAMIAN_BIND=0.0.0.0:8080
EXPOSE 8080
# A number, so that an orchestrator can see that it is not root without reading /etc/passwd.
USER 10001:10001
# The probe is the binary itself: the image has no curl.
HEALTHCHECK --interval=30s --timeout=3s --start-period=5s CMD ["/usr/local/bin/gramian", "health"]
ENTRYPOINT ["/usr/local/bin/gramian"]
