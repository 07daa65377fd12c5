# The program with lavapipe, so that it needs no GPU:
#   docker build -t rtfmesh .
#   docker run --rm -u "$(id -u):$(id -g)" -v "$PWD:/work" rtfmesh remesh scan.ply scan-10k.ply -n 10k
# AMD and Intel GPUs are used with --device /dev/dri, for Mesa's drivers for them are in the image. NVIDIA's
# driver comes from the host, by the NVIDIA Container Toolkit and --gpus all. `rtfmesh devices` shows what is found.
FROM rust:1.95-bookworm AS build
WORKDIR /source
COPY . .
RUN ./ci/setup.sh && CARGO_PROFILE_RELEASE_DEBUG=none CARGO_PROFILE_RELEASE_STRIP=true cargo build --release --locked

FROM debian:bookworm-slim
RUN apt-get update && \
    apt-get install -y --no-install-recommends libvulkan1 mesa-vulkan-drivers && \
    rm -rf /var/lib/apt/lists/*
COPY --from=build /source/target/release/rtfmesh /usr/local/bin/rtfmesh
# Vulkan is among what containers do not get from NVIDIA's driver unless they ask for graphics. Any user may
# write compiled kernels to the cache.
ENV NVIDIA_DRIVER_CAPABILITIES=graphics,utility RTFMESH_CACHE_DIR=/tmp/rtfmesh-cache
WORKDIR /work
USER 1000:1000
ENTRYPOINT ["rtfmesh"]
