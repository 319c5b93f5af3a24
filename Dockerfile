# docker build -t rasp-kit . && docker run -p 8888:8888 rasp-kit
FROM python:3.11-slim-bookworm
WORKDIR /kit
COPY apt.txt ./
RUN apt-get update \
    && apt-get install -y --no-install-recommends make git $(cat apt.txt) \
    && rm -rf /var/lib/apt/lists/*
COPY . .
RUN make setup
EXPOSE 8888
CMD [".venv/bin/jupyter", "lab", "--ip=0.0.0.0", "--allow-root", "--no-browser", "notebooks"]
