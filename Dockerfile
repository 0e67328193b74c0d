# Graspbench with its pinned libraries, inner loops compiled. See README.md, "In a container".
#   docker build -t graspbench .
#   docker run --rm -v "$PWD/results:/study/results" graspbench run
FROM python:3.11-slim-bookworm

RUN apt-get update && apt-get install -y --no-install-recommends libgomp1 libstdc++6 && rm -rf /var/lib/apt/lists/*

# The libraries first: a change of the code leaves them as they are.
WORKDIR /opt/graspbench
COPY requirements.txt .
RUN pip install --no-cache-dir --require-hashes -r requirements.txt

COPY . .
RUN pip install --no-cache-dir --no-deps --no-build-isolation . && python -m graspbench.trial.warm_up

WORKDIR /study
ENTRYPOINT ["graspbench"]
CMD ["--help"]
