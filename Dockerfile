# docker build -t tactile_cube . && docker run --rm -v "$PWD/outputs:/app/outputs" tactile_cube evaluate policy=default
FROM python:3.11-slim
RUN apt-get update && apt-get install -y --no-install-recommends make && rm -rf /var/lib/apt/lists/*
WORKDIR /app
COPY LICENSE Makefile README.md pyproject.toml requirements.txt ./
COPY conf conf
COPY src src
RUN make .venv/installed
ENTRYPOINT ["/app/.venv/bin/tactile-cube"]
CMD ["--help"]
