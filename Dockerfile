# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Four images from one build, on Debian 12:
#
#   docker build --target server -t ccslice/server .              ccsliced with all encodings
#   docker build --target server-slim -t ccslice/server-slim .    ccsliced without OpenImageIO: raw, zstd and PNG
#   docker build --target client -t ccslice/client .              ccslice, the command line; mount a folder at /data
#   docker build --target farm -t ccslice/farm .                  a worker of deploy/farm; mount the jobs' folder at /jobs
#
# They run as a user that isn't root, need no capability and write nothing to their root file system. Packages are
# installed in stages that see deploy/install.sh only (its groups are the one list of them), so a change of the sources
# installs nothing again. deploy/check-image.sh builds and tries all this without a Docker engine.

ARG DEBIAN=debian:12-slim

# Compiling.

FROM ${DEBIAN} AS build-packages
COPY deploy/install.sh /tmp/
RUN /tmp/install.sh build && apt-get clean && rm -rf /var/lib/apt/lists/*

FROM build-packages AS sources
WORKDIR /src
COPY CMakeLists.txt CMakePresets.json LICENSE NOTICE VERSION ./
COPY cmake cmake
COPY proto proto
COPY core core
COPY server server
COPY client client
COPY docs/schemas docs/schemas

# The slim server differs by the sources that include OpenImageIO; only they are compiled a second time.
FROM sources AS build
# Empty: what the file VERSION says, since the history isn't here.
ARG VERSION=
RUN cmake --preset release -DCCSLICE_BUILD_TESTS=OFF -DCCSLICE_VERSION="${VERSION}" \
  && cmake --build --preset release --parallel "$(nproc)" \
  && cmake --install build/release --strip --prefix /opt/full
RUN cmake --preset release -DCCSLICE_BUILD_TESTS=OFF -DCCSLICE_WITH_OPENIMAGEIO=OFF \
  && cmake --build --preset release --parallel "$(nproc)" \
  && cmake --install build/release --strip --prefix /opt/slim

# Running.

FROM ${DEBIAN} AS runtime
COPY LICENSE NOTICE /usr/share/doc/ccslice/
COPY deploy/install.sh /tmp/
LABEL org.opencontainers.image.licenses="Apache-2.0"

# The health check asks where CCSLICE_LISTEN says, so set that rather than --listen. A container serves beyond itself.
FROM runtime AS server-runtime
# By convention health alone is on port 50053 (CCSLICE_HEALTH_LISTEN), figures are on 9464 (CCSLICE_METRICS_LISTEN).
ENV CCSLICE_LISTEN=0.0.0.0:50051
EXPOSE 50051 50053 9464
# Where CCSLICE_MESH_STORE=dir:/meshes keeps meshes. A new volume belongs to whom the folder belongs to.
RUN install --directory --owner 65532 --group 65532 /meshes
VOLUME /meshes
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=10s --timeout=5s --start-period=5s --retries=3 CMD ["/usr/local/bin/ccsliced", "--health-check"]
ENTRYPOINT ["/usr/local/bin/ccsliced"]

FROM server-runtime AS server-packages
RUN /tmp/install.sh server && apt-get clean && rm -rf /tmp/install.sh /var/lib/apt/lists/*

FROM server-runtime AS server-slim-packages
RUN /tmp/install.sh server-slim && apt-get clean && rm -rf /tmp/install.sh /var/lib/apt/lists/*

FROM runtime AS client-packages
RUN /tmp/install.sh client && apt-get clean && rm -rf /tmp/install.sh /var/lib/apt/lists/*

FROM runtime AS farm-packages
RUN /tmp/install.sh client farm && apt-get clean && rm -rf /tmp/install.sh /var/lib/apt/lists/* \
  && install --directory --owner 65532 --group 65532 /jobs

FROM server-packages AS server
COPY --from=build /opt/full/bin/ccsliced /usr/local/bin/
USER 65532:65532
ARG VERSION=unknown
ARG REVISION=unknown
LABEL org.opencontainers.image.title="ccsliced" \
  org.opencontainers.image.description="Slices Catmull-Clark solids into voxel layers, over gRPC" \
  org.opencontainers.image.version="${VERSION}" \
  org.opencontainers.image.revision="${REVISION}"

FROM server-slim-packages AS server-slim
COPY --from=build /opt/slim/bin/ccsliced /usr/local/bin/
USER 65532:65532
ARG VERSION=unknown
ARG REVISION=unknown
LABEL org.opencontainers.image.title="ccsliced, slim" \
  org.opencontainers.image.description="Slices Catmull-Clark solids into voxel layers, over gRPC; raw, zstd and PNG planes" \
  org.opencontainers.image.version="${VERSION}" \
  org.opencontainers.image.revision="${REVISION}"

FROM client-packages AS client
COPY --from=build /opt/full/bin/ccslice /usr/local/bin/
WORKDIR /data
USER 65532:65532
ENTRYPOINT ["/usr/local/bin/ccslice"]
ARG VERSION=unknown
ARG REVISION=unknown
LABEL org.opencontainers.image.title="ccslice" \
  org.opencontainers.image.description="Command line of ccsliced, the slicer of Catmull-Clark solids" \
  org.opencontainers.image.version="${VERSION}" \
  org.opencontainers.image.revision="${REVISION}"

FROM farm-packages AS farm
COPY --from=build /opt/full/bin/ccslice /usr/local/bin/
COPY deploy/farm/*.py /usr/local/share/ccslice-farm/
ENV PYTHONPATH=/usr/local/share/ccslice-farm \
  PYTHONDONTWRITEBYTECODE=1 \
  CCSLICE_FARM_FOLDER=/jobs
WORKDIR /jobs
USER 65532:65532
# The package has the module alone, no program.
ENTRYPOINT ["python3", "-m", "celery", "-A", "farm"]
CMD ["worker", "--concurrency", "1", "--loglevel", "info"]
ARG VERSION=unknown
ARG REVISION=unknown
LABEL org.opencontainers.image.title="ccslice, farm" \
  org.opencontainers.image.description="A worker that slices shares of a print farm's jobs" \
  org.opencontainers.image.version="${VERSION}" \
  org.opencontainers.image.revision="${REVISION}"
