# Cairn built from this checkout, for this kind of processor:  docker build -t cairn . && docker run --rm -it -v "$PWD:/work" cairn doctor
FROM debian:bookworm-slim AS build
RUN apt-get update && apt-get install -y --no-install-recommends \
    g++ gfortran cmake ninja-build python3-dev python3-pip python3-venv libeigen3-dev liblapack-dev libsuitesparse-dev libopenmpi-dev \
    && rm -rf /var/lib/apt/lists/*
COPY . /src
RUN python3 -m venv /opt/cairn && /opt/cairn/bin/pip install --no-cache-dir "/src[all]"

FROM debian:bookworm-slim
RUN apt-get update && apt-get install -y --no-install-recommends \
    python3 libgfortran5 libgomp1 liblapack3 libcholmod3 libumfpack5 libamd2 libosmesa6 libx11-6 openmpi-bin \
    libglu1-mesa libxcursor1 libxft2 libxinerama1 libxrender1 libxfixes3 libfontconfig1 \
    && rm -rf /var/lib/apt/lists/*
COPY --from=build /opt/cairn /opt/cairn
ENV PATH=/opt/cairn/bin:$PATH
WORKDIR /work
ENTRYPOINT ["cairn"]
