# docker build -t tactile_cube . && docker run --rm -v "$PWD/outputs:/work/outputs" tactile_cube evaluate policy=default
FROM python:3.11-slim
RUN apt-get update && apt-get install -y --no-install-recommends gcc libc6-dev make && rm -rf /var/lib/apt/lists/*
WORKDIR /work
COPY LICENSE Makefile README.md pyproject.toml requirements.txt ./
COPY conf conf
COPY src src
RUN make .venv/installed
ENTRYPOINT [".venv/bin/tactile-cube"]
CMD ["--help"]
